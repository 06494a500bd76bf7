# forest_module([VECTOR_LOOPS] [DEPENDS <module>...] [PRIVATE <target>...])
#
# A module is a folder of .h/.cpp pairs with their *_test.cpp beside them. From
# the folder follow: library forest_<name> (alias forest::<name>), one test
# program, and a check that each header without a .cpp compiles alone (the
# others stand first in theirs, which tools/check_layers.py sees to).
# GCC 12 warns falsely of std::string concatenation (-Wrestrict, GCC bug 105329) and of Eigen vectors (-Warray-bounds).
set(FOREST_WARNINGS -Wall -Wextra -Wshadow -Wconversion $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict> $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>
                    $<$<BOOL:${FOREST_WARNINGS_AS_ERRORS}>:-Werror>)
if(FOREST_SANITIZE) # but not `vptr`: SOCI keeps its type information to itself
  add_compile_options(-fsanitize=${FOREST_SANITIZE} -fno-sanitize=vptr -fno-sanitize-recover=all -fno-omit-frame-pointer)
  # Wrong pointers the address sanitizer finds where they are used; looking at each of Eigen's takes two fifths of the build.
  add_compile_options(-fno-sanitize=null,pointer-overflow,alignment,object-size,nonnull-attribute,returns-nonnull-attribute)
  add_compile_options($<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>) # GCC 12 sees it falsely in <regex> with sanitizers
  add_link_options(-fsanitize=${FOREST_SANITIZE})
endif()

# Headers that nearly everything reads are compiled once for all libraries, and once for all tests. Sanitized builds do without those
# of libraries, so that a file that forgets to include what it uses is found there.
function(forest_precompiled name)
  file(CONFIGURE OUTPUT ${name}.cpp CONTENT "// Its precompiled headers are all that is wanted of it.\n")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  target_compile_features(${name} PRIVATE cxx_std_20)
  target_include_directories(${name} SYSTEM PRIVATE ${EIGEN_INCLUDE_DIRS})
  target_precompile_headers(${name} PRIVATE ${ARGN})
endfunction()
# For ccache; and GCC 12 warns falsely of std::vector when its headers come precompiled.
set(FOREST_PRECOMPILED $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess> $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>)
set(FOREST_TEST_OPTIONS ${FOREST_WARNINGS} ${FOREST_PRECOMPILED} -O1) # building them at -O3 takes longer than running them
if(FOREST_SANITIZE) # what a test calls is looked at in full; the test itself for its memory alone, which is sooner built
  list(APPEND FOREST_TEST_OPTIONS -fno-sanitize=undefined)
endif()
forest_precompiled(precompiled_tests <gmock/gmock.h> <gtest/gtest.h> <Eigen/Core> <Eigen/Geometry>)
target_compile_options(precompiled_tests PRIVATE ${FOREST_TEST_OPTIONS})
target_compile_definitions(precompiled_tests PRIVATE FOREST_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
target_link_libraries(precompiled_tests PRIVATE GTest::gtest GTest::gmock)
# In rooms with VECTOR_LOOPS, loops are written so that the compiler makes vectors of them, one copy for each kind of processor
# (forest/core/clones.h); without contraction, all of them and clang give the same bits.
set(FOREST_VECTOR_LOOPS -fno-math-errno -fno-trapping-math -ffp-contract=off)
if(NOT FOREST_SANITIZE)
  foreach(name precompiled precompiled_vector_loops)
    forest_precompiled(${name} <algorithm> <array> <cmath> <map> <optional> <span> <string> <vector> <Eigen/Core> <Eigen/Geometry>
                       <fmt/format.h>)
    target_compile_options(${name} PRIVATE ${FOREST_WARNINGS} ${FOREST_PRECOMPILED})
    target_link_libraries(${name} PRIVATE fmt::fmt)
  endforeach()
  target_compile_options(precompiled_vector_loops PRIVATE ${FOREST_VECTOR_LOOPS})
endif()

# A test program that ctest runs, told where the project and the real data are.
function(forest_test target)
  target_compile_definitions(${target} PRIVATE FOREST_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_compile_options(${target} PRIVATE ${FOREST_TEST_OPTIONS})
  target_link_libraries(${target} PRIVATE GTest::gtest_main GTest::gmock rapidcheck)
  target_precompile_headers(${target} REUSE_FROM precompiled_tests)
endfunction()

function(forest_module)
  cmake_parse_arguments(PARSE_ARGV 0 arg "VECTOR_LOOPS" "" "DEPENDS;PRIVATE")
  file(RELATIVE_PATH name ${PROJECT_SOURCE_DIR}/forest ${CMAKE_CURRENT_SOURCE_DIR})
  string(REPLACE "/" "_" name ${name})
  string(REPLACE "/" "_" depends "${arg_DEPENDS}")
  list(TRANSFORM depends PREPEND "forest::")

  file(GLOB headers CONFIGURE_DEPENDS *.h)
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  set(tests ${sources})
  list(FILTER tests INCLUDE REGEX "_test\\.cpp$")
  list(FILTER sources EXCLUDE REGEX "_test\\.cpp$")
  set(alone ${headers}) # headers with nothing but themselves
  foreach(source ${sources})
    string(REGEX REPLACE "cpp$" "h" header ${source})
    list(REMOVE_ITEM alone ${header})
  endforeach()

  if(sources)
    add_library(forest_${name} ${sources})
    set(scope PUBLIC)
    target_compile_options(forest_${name} PRIVATE ${FOREST_WARNINGS})
    target_link_libraries(forest_${name} PRIVATE ${arg_PRIVATE})
    set(precompiled precompiled)
    if(arg_VECTOR_LOOPS)
      set(precompiled precompiled_vector_loops)
      target_compile_options(forest_${name} PRIVATE ${FOREST_VECTOR_LOOPS})
    endif()
    if(TARGET ${precompiled} AND "fmt::fmt" IN_LIST arg_PRIVATE) # whose definitions it has
      target_compile_options(forest_${name} PRIVATE ${FOREST_PRECOMPILED})
      target_precompile_headers(forest_${name} REUSE_FROM ${precompiled})
    endif()
  else()
    add_library(forest_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(forest::${name} ALIAS forest_${name})
  target_compile_features(forest_${name} ${scope} cxx_std_20)
  target_sources(forest_${name} ${scope} FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${headers})
  target_sources(forest_${name} ${scope} FILE_SET alone TYPE HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${alone})
  set_target_properties(forest_${name} PROPERTIES INTERFACE_HEADER_SETS_TO_VERIFY alone)
  target_link_libraries(forest_${name} ${scope} ${depends})
  target_include_directories(forest_${name} SYSTEM ${scope} ${EIGEN_INCLUDE_DIRS})

  if(tests)
    add_executable(forest_${name}_test ${tests})
    target_link_libraries(forest_${name}_test PRIVATE forest::${name} ${arg_PRIVATE})
    forest_test(forest_${name}_test)
    add_test(NAME ${name} COMMAND forest_${name}_test)
    set_tests_properties(${name} PROPERTIES LABELS unit)
    add_dependencies(unit_tests forest_${name}_test)
  endif()
endfunction()
