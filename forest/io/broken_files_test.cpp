// SPDX-License-Identifier: Apache-2.0
// Malformed and edge-case files of other tools' tests: for every one of them what it becomes here, in one table. What the
// other tool does stands in the index beside the files (EXPECTED.csv); where tools disagree or refuse what can be read, the
// reading that serves the person with the file was chosen, and is written down in docs/formats.
#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/format.h"
#include "forest/morphology/validate.h"

#include "tests/real_data.h"

namespace forest::io {
namespace {

struct Row {
  std::string_view file;
  int sections;  // of all cells; refused: -1
  int points;
  std::string_view
      told;  // the kinds of warning, each with its first line; of a refusal the line and a part of it
  std::string_view found = {};  // what validation finds
  bool operator==(const Row&) const = default;
};

const std::vector<Row> table{
    // clang-format off
    {"cvapp_cases/Case1_new.swc", 3, 6, "blank-line:7 late-comment:8"},
    {"cvapp_cases/Case1_orig.swc", 3, 6, "soma-contour:4 blank-line:9 late-comment:10 id-order:12 duplicate-id:12"},
    {"cvapp_cases/Case2_new.swc", 4, 9, "blank-line:9", "no-soma single-point-stem multifurcation"},
    {"cvapp_cases/Case2_orig.swc", 4, 9, "blank-line:8", "no-soma single-point-stem multifurcation"},
    {"cvapp_cases/Case3_new.swc", 1, 3, "blank-line:7 late-comment:8"},
    {"cvapp_cases/Case3_orig.swc", 1, 3, "soma-contour:4 blank-line:9 late-comment:22"},
    {"cvapp_cases/Case4_new.swc", 3, 6, "blank-line:10 late-comment:11"},
    {"cvapp_cases/Case4_orig.swc", 3, 6, "blank-line:9 late-comment:10"},
    {"cvapp_cases/Case5_new.swc", 3, 6, "blank-line:7 late-comment:8"},
    {"cvapp_cases/Case5_orig.swc", 3, 7, "blank-line:5 late-comment:6"},
    {"cvapp_cases/NeuroML2/Case1_new.cell.nml", 3, 6, "names-not-kept:15 groups-not-kept:47", ""},
    {"cvapp_cases/NeuroML2/Case1_new_morphOnly.cell.nml", 3, 6, "names-not-kept:14 groups-not-kept:46", ""},
    {"cvapp_cases/NeuroML2/Case1_orig.cell.nml", 0, 0, "names-not-kept:15 groups-not-kept:45 group:53", "no-section"},
    {"cvapp_cases/NeuroML2/Case1_orig_morphOnly.cell.nml", 0, 0, "names-not-kept:14 groups-not-kept:44 group:52", "no-section"},
    {"cvapp_cases/NeuroML2/Case2_new.cell.nml", 4, 10, "names-not-kept:13 groups-not-kept:47", "no-soma zero-length multifurcation"},
    {"cvapp_cases/NeuroML2/Case2_new_morphOnly.cell.nml", 4, 10, "names-not-kept:12 groups-not-kept:46", "no-soma zero-length multifurcation"},
    {"cvapp_cases/NeuroML2/Case2_orig.cell.nml", 4, 10, "names-not-kept:13 groups-not-kept:47", "no-soma zero-length multifurcation"},
    {"cvapp_cases/NeuroML2/Case2_orig_morphOnly.cell.nml", 4, 10, "names-not-kept:12 groups-not-kept:46", "no-soma zero-length multifurcation"},
    {"cvapp_cases/NeuroML2/Case3_new.cell.nml", 1, 3, "names-not-kept:15 groups-not-kept:40", ""},
    {"cvapp_cases/NeuroML2/Case3_new_morphOnly.cell.nml", 1, 3, "names-not-kept:14 groups-not-kept:39", ""},
    {"cvapp_cases/NeuroML2/Case3_orig.cell.nml", 1, 3, "names-not-kept:15 groups-not-kept:100", ""},
    {"cvapp_cases/NeuroML2/Case3_orig_morphOnly.cell.nml", 1, 3, "names-not-kept:14 groups-not-kept:99", ""},
    {"cvapp_cases/NeuroML2/Case4_new.cell.nml", 3, 6, "names-not-kept:15 groups-not-kept:56", ""},
    {"cvapp_cases/NeuroML2/Case4_new_morphOnly.cell.nml", 3, 6, "names-not-kept:14 groups-not-kept:55", ""},
    {"cvapp_cases/NeuroML2/Case4_orig.cell.nml", 3, 6, "names-not-kept:15 groups-not-kept:56", ""},
    {"cvapp_cases/NeuroML2/Case4_orig_morphOnly.cell.nml", 3, 6, "names-not-kept:14 groups-not-kept:55", ""},
    {"cvapp_cases/NeuroML2/Case5_new.cell.nml", 3, 6, "names-not-kept:15 groups-not-kept:51", ""},
    {"cvapp_cases/NeuroML2/Case5_new_morphOnly.cell.nml", 3, 6, "names-not-kept:14 groups-not-kept:50", ""},
    {"cvapp_cases/NeuroML2/Case5_orig.cell.nml", 3, 7, "names-not-kept:13 groups-not-kept:48", ""},
    {"cvapp_cases/NeuroML2/Case5_orig_morphOnly.cell.nml", 3, 7, "names-not-kept:12 groups-not-kept:47", ""},
    {"inline_morphio_asc/explicit_duplicates_with_arbitrary_diameter_1.asc", 3, 10, "comments-not-kept:8", "no-soma"},
    {"inline_morphio_asc/multiple_soma_1.asc", 0, 0, "properties-not-kept:3 several-outlines:9", "no-section"},
    {"inline_morphio_asc/parse_number_with_plus_symbol_1.asc", 0, 0, "properties-not-kept:2 comments-not-kept:5", "no-section"},
    {"inline_morphio_asc/section_single_point_1.asc", 3, 9, "comments-not-kept:8", "no-soma"},
    {"inline_morphio_asc/single_children_1.asc", 4, 11, "single-daughter:7", "no-soma unifurcation"},
    {"inline_morphio_asc/single_neurite_no_soma_1.asc", 1, 2, "", "no-soma"},
    {"inline_morphio_asc/single_point_section_duplicate_parent_1.asc", 1, 2, "only-branch-point:6 comments-not-kept:6", "no-soma"},
    {"inline_morphio_asc/single_point_section_duplicate_parent_complex_1.asc", 4, 8, "only-branch-point:7 comments-not-kept:7", "no-soma multifurcation"},
    {"inline_morphio_asc/skip_header_1.asc", 1, 2, "", "no-soma"},
    {"inline_morphio_asc/unfinished_file_1.asc", -1, 0, "12: the file ends inside of a split (opened on line 7) of a tree that begins on line 2"},
    {"inline_morphio_asc/unfinished_point_1.asc", -1, 0, "4: the file ends inside of a point that begins on line 4"},
    {"inline_morphio_asc/unknown_token_1.asc", -1, 0, "6: \"Z\" is not a number"},
    {"inline_morphio_swc/axon_carrying_dendrite_1.swc", 4, 9, "blank-line:5 trailing-comment:6", "multifurcation kind-change"},
    {"inline_morphio_swc/basic_1.swc", 1, 1, "", "single-point-stem"},
    {"inline_morphio_swc/build_from_string_1.swc", 1, 4, ""},
    {"inline_morphio_swc/cyclic_1.swc", 6, 12, "zero-radius:4 trailing-comment:6 self-parent:6", "zero-radius"},
    {"inline_morphio_swc/extra_column_1.swc", 1, 1, "extra-columns:2", "single-point-stem"},
    {"inline_morphio_swc/missing_parent_1.swc", 2, 3, "missing-parent:5", "single-point-stem"},
    {"inline_morphio_swc/multi_type_section_1.swc", 4, 7, "trailing-comment:2 type-change:3", "single-point-stem unifurcation kind-change"},
    {"inline_morphio_swc/neurite_followed_by_soma_1.swc", 1, 5, "trailing-comment:7 soma-under-neurite:7"},
    {"inline_morphio_swc/no_soma_1.swc", 1, 3, "", "no-soma zero-length"},
    {"inline_morphio_swc/read_duplicate_1.swc", 4, 9, "late-comment:6", "multifurcation"},
    {"inline_morphio_swc/read_single_neurite_1.swc", 1, 4, ""},
    {"inline_morphio_swc/read_split_soma_1.swc", 2, 8, "late-comment:6"},
    {"inline_morphio_swc/read_weird_ids_1.swc", 1, 4, "trailing-comment:1 first-id:1 child-first:1 id-order:2"},
    {"inline_morphio_swc/repeated_id_1.swc", 1, 4, "trailing-comment:6 id-order:6 repeated-row:6"},
    {"inline_morphio_swc/simple_reversed_1.swc", 6, 12, "child-first:4 zero-radius:4", "zero-radius"},
    {"inline_morphio_swc/skip_comments_1.swc", 1, 4, "late-comment:6"},
    {"inline_morphio_swc/soma_type_2_point_1.swc", 0, 0, "", "no-section"},
    {"inline_morphio_swc/soma_type_3_point_1.swc", 0, 0, "trailing-comment:3", "no-section"},
    {"inline_morphio_swc/soma_type_3_point_neuromorpho_1.swc", 0, 0, "trailing-comment:3", "no-section"},
    {"inline_morphio_swc/soma_type_3_point_neuromorpho_2.swc", 0, 0, "trailing-comment:2 soma-three-points-off:2", "no-section"},
    {"inline_morphio_swc/soma_type_3_point_neuromorpho_3.swc", 0, 0, "trailing-comment:2 soma-three-points-off:2", "no-section"},
    {"inline_morphio_swc/soma_type_many_point_1.swc", 0, 0, "", "no-section"},
    {"inline_morphio_swc/swc_threepoint_soma_tolerance_1.swc", 0, 0, "", "no-section"},
    {"inline_morphio_swc/swc_threepoint_soma_tolerance_2.swc", 0, 0, "", "no-section"},
    {"inline_morphio_swc/swc_threepoint_soma_tolerance_3.swc", 0, 0, "", "no-section"},
    {"inline_morphio_swc/swc_threepoint_soma_tolerance_4.swc", 0, 0, "soma-three-points-inexact:3", "no-section"},
    {"inline_morphio_swc/throw_on_missing_data_1.swc", -1, 0, "3: \"3 3\" has 2 of 7 columns"},
    {"inline_morphio_swc/throw_on_negative_id_1.swc", 2, 3, "id-order:2 negative-id:2 missing-parent:3", "no-soma zero-length single-point-stem"},
    {"inline_morphio_swc/unsupported_section_type_1.swc", 2, 3, "trailing-comment:3 type-negative:3 type-change:3", "single-point-stem unifurcation kind-change"},
    {"inline_morphio_swc/unsupported_section_type_2.swc", 2, 3, "trailing-comment:3 type-custom:3 type-change:3", "single-point-stem unifurcation kind-change"},
    {"inline_morphio_swc/weird_indent_1.swc", 6, 12, "blank-line:9 zero-radius:11 trailing-comment:20", "zero-radius"},
    {"inline_morphio_swc/zero_diameter_1.swc", 1, 2, "zero-radius:4", "zero-radius narrow-start"},
    {"morphio/annotations.asc", 2, 7, "single-daughter:6 empty-branch:10 comments-not-kept:10", "no-soma unifurcation"},
    {"morphio/astrocyte.h5", 1315, 6222, "", "narrow-start"},
    {"morphio/circle_contour.asc", 1, 2, "properties-not-kept:4"},
    {"morphio/complexe.swc", 1, 9, ""},
    {"morphio/disconnected_neurite.swc", 7, 13, "trailing-comment:10 several-roots:10", "single-point-stem far-stem"},
    {"morphio/h5/empty.h5", -1, 0, "0: holds no neuron: no group of it has the arrays points and structure"},
    {"morphio/h5/merged.h5", 1976, 109777, "", "zero-length fat-end multifurcation"},
    {"morphio/h5/non-valid.h5", -1, 0, "0: is empty"},
    {"morphio/h5/v1/Neuron-no-soma.h5", 84, 924, "", "no-soma narrow-start"},
    {"morphio/h5/v1/Neuron.h5", 84, 924, "", "narrow-start"},
    {"morphio/h5/v1/endoplasmic-reticulum.h5", 6, 12, ""},
    {"morphio/h5/v1/glia.h5", 1, 2, "glia-unsaid:0 soma-two-points:0"},
    {"morphio/h5/v1/glia_empty_perimeters.h5", -1, 0, "0: is a glia cell without perimeters, which such files must have"},
    {"morphio/h5/v1/glia_soma_only.h5", 0, 0, "perimeters-size:0", "no-section"},
    {"morphio/h5/v1/glia_wrong_sized_perimeters.h5", -1, 0, "0: has perimeters in several columns"},
    {"morphio/h5/v1/h5v1.4.h5", -1, 0, "0: is of version 1.4 of the format"},
    {"morphio/h5/v1/incorrect_point_columns.h5", -1, 0, "0: array points has not 4 columns"},
    {"morphio/h5/v1/incorrect_structure_columns.h5", -1, 0, "0: array structure has not 3 columns"},
    {"morphio/h5/v1/merged.h5", 19, 41, "glia-unsaid:0 soma-two-points:0 empty-section:0 joint-missing:0 single-daughter:0", "no-soma unifurcation narrow-start"},
    {"morphio/h5/v1/metadata_group_only.h5", -1, 0, "0: array points was never filled"},
    {"morphio/h5/v1/mitochondria.h5", 1, 2, "glia-unsaid:0 soma-two-points:0"},
    {"morphio/h5/v1/monodim.h5", -1, 0, "0: array points has not 4 columns"},
    {"morphio/h5/v1/reversed_NRN_neurite_order.h5", 2, 4, "empty-section:0"},
    {"morphio/h5/v1/simple-broken-section-type.h5", -1, 0, "0: has a soma of one point"},
    {"morphio/h5/v1/simple-dendritric-spine.h5", 3, 9, "joint-missing:0 single-daughter:0", "no-soma unifurcation narrow-start"},
    {"morphio/h5/v1/simple-negative-section-type.h5", -1, 0, "0: has a soma of one point"},
    {"morphio/h5/v1/simple-single-point-soma.h5", -1, 0, "0: has a soma of one point"},
    {"morphio/h5/v1/simple-two-point-soma.h5", 6, 12, "soma-two-points:0"},
    {"morphio/h5/v1/simple.h5", 6, 12, ""},
    {"morphio/h5/v1/single-neurite.h5", 1, 3, "", "no-soma"},
    {"morphio/h5/v1/soma_after_dendrite.h5", -1, 0, "0: row 1 of structure is of type 1"},
    {"morphio/h5/v1/soma_no_neurites.h5", 0, 0, "", "no-section"},
    {"morphio/h5/v1/three-point-soma-two-offset.h5", -1, 0, "0: row 1 of structure is of type 1"},
    {"morphio/h5/v1/two_child_unmerged.h5", 8, 19, "single-daughter:0", "unifurcation"},
    {"morphio/h5/v1/unknown_section_type_structure.h5", -1, 0, "0: row 0 of structure begins at point 10 of 2"},
    {"morphio/h5/v2/Neuron.h5", 84, 924, "version-2:0", "narrow-start"},
    {"morphio/h5/vasculature-broken-section-type.h5", -1, 0, "0: holds blood vessels (connectivity), not a neuron"},
    {"morphio/h5/vasculature1.h5", -1, 0, "0: holds blood vessels (connectivity), not a neuron"},
    {"morphio/h5/vasculature2.h5", -1, 0, "0: holds blood vessels (connectivity), not a neuron"},
    {"morphio/invalid-incomplete.asc", -1, 0, "15: a point follows \"Incomplete\", which ends its branch"},
    {"morphio/iterators.asc", 10, 20, "properties-not-kept:2", "zero-radius"},
    {"morphio/marker-with-string.asc", 0, 0, "properties-not-kept:9", "no-section"},
    {"morphio/markers.asc", 5, 15, "", "no-soma zero-length"},
    {"morphio/mono-type.asc", 8, 16, "small-outline:1 properties-not-kept:2"},
    {"morphio/multiple_point_section.asc", 4, 14, "properties-not-kept:4"},
    {"morphio/multiple_soma.swc", 6, 12, "several-somata:11"},
    {"morphio/nested_single_children.asc", 4, 8, "single-daughter:13 comments-not-kept:16", "unifurcation"},
    {"morphio/neurite_wrong_root_point.swc", 2, 4, "trailing-comment:4 soma-three-points-attachment:4"},
    {"morphio/no_soma.swc", 3, 5, "", "no-soma single-point-stem"},
    {"morphio/nrn-order-already-sorted.h5", 110, 6088, "", "far-stem fat-end multifurcation narrow-start"},
    {"morphio/nrn_ordering.swc", 122, 3895, "", "multifurcation"},
    {"morphio/pia.asc", 1, 4, "properties-not-kept:23", "far-stem"},
    {"morphio/reversed_NRN_neurite_order.swc", 3, 6, "trailing-comment:4", "far-stem"},
    {"morphio/sections-block.asc", 6, 12, "properties-not-kept:14"},
    {"morphio/simple-all-types.swc", 15, 30, "blank-line:3"},
    {"morphio/simple-heterogeneous-neurite.swc", 6, 12, "", "kind-change"},
    {"morphio/simple-trailing-space.swc", 1, 3, "late-comment:3", "no-soma"},
    {"morphio/simple-windows-eol.swc", 6, 12, "line-ends:1"},
    {"morphio/simple-with-font.asc", 6, 12, "properties-not-kept:4"},
    {"morphio/simple-with-image-coord.asc", 6, 12, "properties-not-kept:10"},
    {"morphio/simple.asc", 6, 12, "properties-not-kept:20"},
    {"morphio/simple.swc", 6, 12, ""},
    {"morphio/simple2.asc", 8, 17, "small-outline:1 properties-not-kept:2"},
    {"morphio/single_point_root.asc", 3, 5, "", "no-soma single-point-stem"},
    {"morphio/soma_cylinders.swc", 1, 2, "", "zero-length"},
    {"morphio/soma_multiple_frustums.swc", 0, 0, "", "no-section"},
    {"morphio/soma_single_frustum.swc", 0, 0, "", "no-section"},
    {"morphio/soma_three_points_cylinder.swc", 0, 0, "", "no-section"},
    {"morphio/spine.asc", 1, 7, "small-outline:4 properties-not-kept:5 comments-not-kept:20", "far-stem"},
    {"morphio/three_point_soma.swc", 4, 20, "late-comment:12", "far-stem"},
    {"neurom/swc/Neuron-flat.swc", 84, 924, "", "zero-length narrow-start"},
    {"neurom/swc/Neuron-monotonic.swc", 84, 924, "zero-radius:48", "zero-radius"},
    {"neurom/swc/Neuron.swc", 84, 924, "", "narrow-start"},
    {"neurom/swc/Neuron_3_random_walker_branches.swc", 3, 1500, "tabs:36", "far-stem"},
    {"neurom/swc/Neuron_disconnected_components.swc", 88, 920, "id-order:40 several-roots:40", "single-point-stem far-stem"},
    {"neurom/swc/Neuron_missing_ids.swc", 6, 9, "zero-radius:38 late-comment:41 id-order:42 missing-parent:42", "zero-radius single-point-stem far-stem"},
    {"neurom/swc/Neuron_missing_parents.swc", 88, 920, "id-order:40 missing-parent:40", "single-point-stem far-stem"},
    {"neurom/swc/Neuron_no_missing_ids_no_zero_segs.swc", 84, 920, "", "narrow-start"},
    {"neurom/swc/Neuron_small_radius.swc", 84, 924, "", "zero-length narrow-start"},
    {"neurom/swc/Neuron_zero_length_sections.swc", 84, 923, "", "zero-length narrow-start"},
    {"neurom/swc/Neuron_zero_length_segments.swc", 84, 924, "", "zero-length narrow-start"},
    {"neurom/swc/Neuron_zero_radius.swc", 1, 6, "", "far-stem"},
    {"neurom/swc/Single_apical.swc", 21, 231, "", "zero-length"},
    {"neurom/swc/Single_apical_no_soma.swc", 21, 231, "first-id:34", "no-soma zero-length"},
    {"neurom/swc/Single_axon.swc", 21, 231, "", "zero-length"},
    {"neurom/swc/Single_basal.swc", 21, 231, "", "zero-length"},
    {"neurom/swc/Soma_origin.swc", 0, 0, "", "no-section"},
    {"neurom/swc/Soma_translated_1.swc", 0, 0, "", "no-section"},
    {"neurom/swc/Soma_translated_2.swc", 0, 0, "", "no-section"},
    {"neurom/swc/custom_type.swc", 6, 12, "zero-radius:6", "zero-radius"},
    {"neurom/swc/dangling_axon.swc", 6, 12, "zero-radius:24", "far-stem zero-radius"},
    {"neurom/swc/dangling_dendrite.swc", 6, 12, "zero-radius:24", "far-stem zero-radius"},
    {"neurom/swc/empty_segments.swc", 3, 5, "trailing-comment:3", "single-point-stem"},
    {"neurom/swc/fat_end.swc", 1, 9, "", "zero-length fat-end"},
    {"neurom/swc/heterogeneous_morphology.swc", 19, 38, "", "kind-change"},
    {"neurom/swc/multiple_somata.swc", 6, 12, "zero-radius:6 trailing-comment:12 several-somata:12", "zero-radius"},
    {"neurom/swc/narrow_start.swc", 1, 3, "", "narrow-start"},
    {"neurom/swc/no-axon.swc", 6, 12, "zero-radius:6", "zero-radius"},
    {"neurom/swc/non_increasing_trunk_off_1_16pt.swc", 0, 0, "zero-radius:32 id-order:36 child-first:36", "no-section"},
    {"neurom/swc/ordering/reversed_NRN_neurite_order.swc", 3, 3, "trailing-comment:4", "single-point-stem"},
    {"neurom/swc/ordering/sample.swc", 8, 58, "first-id:3"},
    {"neurom/swc/ordering/sample_disordered.swc", 8, 58, "first-id:3"},
    {"neurom/swc/ordering/sample_mixed_tree_sections.swc", 8, 58, "first-id:3 late-comment:4"},
    {"neurom/swc/point_soma.swc", 0, 0, "", "no-section"},
    {"neurom/swc/point_soma_single_neurite.swc", 1, 4, ""},
    {"neurom/swc/point_soma_single_neurite2.swc", 1, 4, "", "far-stem"},
    {"neurom/swc/random_trunk_off_0_16pt.swc", 2, 17, "first-id:33 type-undefined:33 type-change:41", "no-soma unifurcation kind-change"},
    {"neurom/swc/repeated_id.swc", 1, 4, "trailing-comment:6 id-order:6 repeated-row:6"},
    {"neurom/swc/root_node_jump.swc", 6, 12, "trailing-comment:6 zero-radius:8", "zero-radius"},
    {"neurom/swc/sequential_trunk_off_0_16pt.swc", 0, 0, "first-id:34 zero-radius:34", "no-section"},
    {"neurom/swc/sequential_trunk_off_1_16pt.swc", 0, 0, "zero-radius:34", "no-section"},
    {"neurom/swc/sequential_trunk_off_42_16pt.swc", 0, 0, "first-id:34 zero-radius:34", "no-section"},
    {"neurom/swc/simple-different-section-types.swc", 6, 12, "zero-radius:24 trailing-comment:25", "zero-radius kind-change"},
    {"neurom/swc/simple-different-soma.swc", 6, 12, "zero-radius:5", "zero-radius"},
    {"neurom/swc/simple.swc", 6, 12, "zero-radius:26", "zero-radius"},
    {"neurom/swc/simple_reversed.swc", 6, 12, "child-first:26 zero-radius:26", "zero-radius"},
    {"neurom/swc/simple_trunk.swc", 4, 8, ""},
    {"neurom/swc/soma/bifurcating_soma.swc", 2, 6, "first-id:4 soma-branches:4 zero-radius:4", "single-point-stem"},
    {"neurom/swc/soma/three_pt_soma.swc", 4, 20, "late-comment:7 zero-radius:8", "zero-radius far-stem"},
    {"neurom/swc/soma_with_neurite_parent.swc", 1, 5, "trailing-comment:8 soma-under-neurite:8"},
    {"neurom/swc/soma_zero_radius.swc", 6, 12, "zero-radius:23", "zero-radius"},
    {"neurom/swc/split_soma_two_neurites.swc", 2, 8, "late-comment:6 soma-three-points-off:12"},
    {"neurom/swc/strahler.swc", 19, 38, ""},
    {"neurom/swc/test_morph.swc", 27, 54, ""},
    {"neurom/swc/undefined_type.swc", 6, 12, "zero-radius:4 type-undefined:6", "zero-radius"},
    {"neurom/swc/z_jump.swc", 2, 10, "", "single-point-stem jump fat-end"},
    {"xyz2swc/NonStandard.swc", 9, 24, "unknown-radius:6 unknown-place:8 type-negative:8 type-change:8 child-first:16 id-order:20 type-undefined:20 self-parent:22", "no-soma single-point-stem zero-radius unifurcation kind-change"},
    // clang-format on
};

/// The first column of a CSV file.
std::set<std::string> files_of_index(const std::filesystem::path& path) {
  std::set<std::string> files;
  std::ifstream in(path);
  std::string line;
  for (std::getline(in, line); std::getline(in, line);) files.insert(line.substr(0, line.find(',')));
  return files;
}

struct Outcome {
  int sections = 0, points = 0;
  std::string told, found;
};

Outcome outcome_of(const std::filesystem::path& path) {
  Outcome outcome;
  try {
    const MappedFile file(path);
    std::set<std::string_view> codes, findings;
    for (const Cell& cell : read_all(format_of(path, file.text()), file.text(), "cell")) {
      const Morphology& m = cell.read.morphology;
      outcome.sections += int(m.sections().size());
      outcome.points += int(m.points().size());
      for (const Warning& w : cell.read.warnings)
        if (codes.insert(w.code).second)
          outcome.told += fmt::format("{}{}:{}", outcome.told.empty() ? "" : " ", w.code, w.line);
      for (const Finding& f : validate(m))
        if (findings.insert(f.code).second)
          outcome.found += fmt::format("{}{}", outcome.found.empty() ? "" : " ", f.code);
    }
  } catch (const InputError& error) {
    outcome = {-1, 0, fmt::format("{}: {}", error.line(), error.sentence()), {}};
  }
  return outcome;
}

TEST(BrokenFiles, EveryOneIsReadOrRefusedAsWrittenDown) {
  FOREST_REAL_DATA(folder, "morphologies/broken");
  for (const Row& row : table) {
    const Outcome got = outcome_of(folder / row.file);
    const bool refused = row.sections < 0 && got.sections < 0;
    const bool same = got.sections == row.sections && got.points == row.points && got.found == row.found &&
                      (refused ? got.told.starts_with(row.told) : got.told == row.told);
    EXPECT_TRUE(same) << fmt::format("{{\"{}\", {}, {}, \"{}\", \"{}\"}},", row.file, got.sections,
                                     got.points, got.told, got.found);
  }
}

TEST(BrokenFiles, TheTableKnowsEveryFileOfTheIndexAndOfTheFolder) {
  FOREST_REAL_DATA(folder, "morphologies/broken");
  std::set<std::string> known;
  for (const Row& row : table) EXPECT_TRUE(known.insert(std::string(row.file)).second) << row.file;
  for (const std::string& file : files_of_index(folder / "EXPECTED.csv"))
    EXPECT_TRUE(known.contains(file)) << file;
  for (const char* const extension : {".swc", ".asc", ".h5", ".nml"})
    for (const auto& path : files_below(folder, extension))
      EXPECT_TRUE(known.contains(path.lexically_relative(folder))) << path;
}

}  // namespace
}  // namespace forest::io
