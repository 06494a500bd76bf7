// SPDX-License-Identifier: Apache-2.0
#include "forest/io/surface.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <zlib.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

#include "tests/real_data.h"
#include "tests/refused.h"

namespace forest::io {
namespace {

// As programs write them, so that readers are not tested by their own.
std::string big_endian(std::uint32_t value) {
  return {char(value >> 24), char(value >> 16), char(value >> 8), char(value)};
}
std::string big_endian(float value) { return big_endian(std::bit_cast<std::uint32_t>(value)); }

// A tetrahedron, in mm.
constexpr float places[4][3] = {{0, 0, 0}, {30, 0, 0}, {0, -20.5, 0}, {0, 0, 1e-3f}};
constexpr std::uint32_t corners[4][3] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};

std::string freesurfer_surface() {
  std::string bytes =
      "\xff\xff\xfe"
      "created by nobody on no day\n\n" +
      big_endian(4u) + big_endian(4u);
  for (const auto& place : places)
    for (const float x : place) bytes += big_endian(x);
  for (const auto& triangle : corners)
    for (const std::uint32_t corner : triangle) bytes += big_endian(corner);
  return bytes;
}

std::string freesurfer_values(std::initializer_list<float> values) {
  std::string bytes =
      "\xff\xff\xff" + big_endian(std::uint32_t(values.size())) + big_endian(4u) + big_endian(1u);
  for (const float value : values) bytes += big_endian(value);
  return bytes;
}

// Areas of three vertices, the last of a colour that no area has.
std::string freesurfer_areas(bool numbered) {
  const auto text = [](const std::string& what) {
    return big_endian(std::uint32_t(what.size() + 1)) + what + '\0';
  };
  std::string bytes = big_endian(3u);
  for (const auto& [vertex, colour] : {std::pair(1u, 0x0a0019u), {0u, 0xff8040u}, {2u, 7u}})
    bytes += big_endian(vertex) + big_endian(colour);
  bytes += big_endian(1u) + big_endian(numbered ? 0xfffffffeu : 2u);
  if (numbered) bytes += big_endian(9u);
  bytes += text("table.ctab");
  if (numbered) bytes += big_endian(2u);
  const auto entry = [&](std::uint32_t number, const std::string& name,
                         std::initializer_list<std::uint32_t> levels) {
    if (numbered) bytes += big_endian(number);
    bytes += text(name);
    for (const std::uint32_t level : levels) bytes += big_endian(level);
  };
  entry(1, "FD", {0x19, 0, 0x0a, 0});
  entry(8, "FA", {0x40, 0x80, 0xff, 255});
  return bytes;
}

std::string base64(const std::string& bytes) {
  constexpr const char* signs = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k < bytes.size() + 1 ? signs[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string deflated(const std::string& bytes, int window = 15) {
  std::string result(bytes.size() + 200, '\0');
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string input = bytes;
  stream.next_in = reinterpret_cast<Bytef*>(input.data()), stream.avail_in = uInt(input.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data()), stream.avail_out = uInt(result.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  result.resize(stream.total_out);
  deflateEnd(&stream);
  return result;
}
std::string gzipped(const std::string& bytes) { return deflated(bytes, 15 + 16); }

template <class T>
std::string raw(const T* values, std::size_t count, bool big) {
  std::string bytes(sizeof(T) * count, '\0');
  std::memcpy(bytes.data(), values, bytes.size());
  if (big)
    for (std::size_t i = 0; i < count; ++i)
      std::reverse(bytes.begin() + std::ptrdiff_t(i * sizeof(T)),
                   bytes.begin() + std::ptrdiff_t((i + 1) * sizeof(T)));
  return bytes;
}

std::string array(const std::string& intent, const std::string& type, const std::string& sizes,
                  const std::string& encoding, const std::string& data,
                  const std::string& more = "Endian=\"LittleEndian\"") {
  return fmt::format(
      "<DataArray Intent=\"NIFTI_INTENT_{}\" DataType=\"NIFTI_TYPE_{}\" {} Encoding=\"{}\" {}>\n<MetaData/>"
      "<Data>{}</Data></DataArray>\n",
      intent, type, sizes, encoding, more, data);
}

std::string gifti(const std::string& inside) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<!DOCTYPE GIFTI SYSTEM \"http://www.nitrc.org/frs/download.php/115/gifti.dtd\">\n"
         "<GIFTI Version=\"1.0\" NumberOfDataArrays=\"2\">\n" +
         inside + "</GIFTI>\n";
}

const std::string point_sizes = "Dimensionality=\"2\" Dim0=\"4\" Dim1=\"3\"";
const std::string value_sizes = "Dimensionality=\"1\" Dim0=\"4\"";

std::string gifti_surface(const std::string& encoding, bool big = false) {
  const auto coded = [&](const std::string& bytes) {
    std::string text = base64(encoding[0] == 'G' ? deflated(bytes) : bytes);
    text.insert(text.size() / 2, "\n  ");  // as some break their lines
    return text;
  };
  const std::string more = big ? "Endian=\"BigEndian\"" : "Endian=\"LittleEndian\"";
  return gifti(array("POINTSET", "FLOAT32", point_sizes, encoding, coded(raw(&places[0][0], 12, big)), more) +
               array("TRIANGLE", "INT32", point_sizes, encoding, coded(raw(&corners[0][0], 12, big)), more));
}

void expect_tetrahedron(const Mesh& mesh) {
  ASSERT_EQ(mesh.positions.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 4u);
  EXPECT_EQ(mesh.labels.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_FLOAT_EQ(mesh.positions[i][Eigen::Index(k)], 1000.f * places[i][k]);
      EXPECT_EQ(mesh.triangles[i][k], corners[i][k]);
    }
}

std::string surface_error(const std::string& bytes) {
  return refused<InputError>([&] { (void)read_surface(bytes, "s"); });
}
std::string values_error(const std::string& bytes) {
  return refused<InputError>([&] { (void)read_surface_values(bytes, "v"); });
}

TEST(Surface, ComesBackFromWhatIsWritten) {
  const Mesh mesh = read_surface(freesurfer_surface(), "lh.pial");
  expect_tetrahedron(read_surface(write_surface(mesh, "rh.pial"), "rh.pial"));
  expect_tetrahedron(read_surface(write_surface(mesh, "rh.surf.gii"), "rh.surf.gii"));
}

TEST(Surface, IsTheSameFromEveryFormatAndInMicrometres) {
  expect_tetrahedron(read_surface(freesurfer_surface(), "lh.pial"));
  expect_tetrahedron(read_surface(freesurfer_surface() + "what FreeSurfer adds", "lh.pial"));
  expect_tetrahedron(read_surface(gzipped(freesurfer_surface()), "lh.pial.gz"));
  for (const bool big : {false, true}) {
    expect_tetrahedron(read_surface(gifti_surface("Base64Binary", big), "g"));
    expect_tetrahedron(read_surface(gifti_surface("GZipBase64Binary", big), "g"));
    expect_tetrahedron(read_surface(gzipped(gifti_surface("GZipBase64Binary", big)), "g.gz"));
  }
  std::string points, faces, columns;
  for (const auto& place : places)
    for (const float x : place) points += fmt::format(" {}\n", x);
  for (std::size_t k = 0; k < 3; ++k)
    for (const auto& triangle : corners) columns += fmt::format("{} ", triangle[k]);
  expect_tetrahedron(read_surface(gifti(array("POINTSET", "FLOAT64", point_sizes, "ASCII", points) +
                                        array("TRIANGLE", "UINT8", point_sizes, "ASCII", columns,
                                              "ArrayIndexingOrder=\"ColumnMajorOrder\"")),
                                  "g"));
}

// Which programs write that leave the numbers as they had them.
TEST(Surface, OfWiderWholeNumbersIsTheSame) {
  const std::string points =
      array("POINTSET", "FLOAT32", point_sizes, "Base64Binary", base64(raw(&places[0][0], 12, false)));
  std::array<std::int64_t, 12> wide{};
  std::copy_n(&corners[0][0], 12, wide.begin());
  const auto with = [&](const char* type, const std::string& bytes) {
    return gifti(points + array("TRIANGLE", type, point_sizes, "Base64Binary", base64(bytes)));
  };
  expect_tetrahedron(read_surface(with("UINT32", raw(&corners[0][0], 12, false)), "g"));
  expect_tetrahedron(read_surface(with("INT64", raw(wide.data(), 12, false)), "g"));
  EXPECT_THAT(surface_error(with("INT16", "")), testing::HasSubstr("write it as NIFTI_TYPE_INT32"));
  wide[5] = -1;
  EXPECT_THAT(surface_error(with("INT64", raw(wide.data(), 12, false))),
              testing::HasSubstr("triangle 1 names vertex -1 of 4"));
}

std::string wavefront() {
  std::string text = "# made for a test\r\nmtllib none.mtl\no t\n";
  for (const auto& place : places) text += fmt::format("v {} {} {} 1 0 0\r\n", place[0], place[1], place[2]);
  text += "vn 0 0 1\ns off\n";
  for (const auto& c : corners) text += fmt::format("f {}/1/1 {}//1 {}\n", c[0] + 1, c[1] + 1, int(c[2]) - 4);
  return text;
}
std::string mni() {
  std::string text = "P 0.3 0.3 0.4 10 1 4\n";
  for (const auto& place : places) text += fmt::format(" {} {} {}\n", place[0], place[1], place[2]);
  text += "\n 0 0 1\n 0 1 0\n 1 0 0\n 0 0 -1\n\n 4\n 0 1 1 1 1\n\n 3 6 9 12\n\n";
  for (const auto& c : corners) text += fmt::format(" {} {} {}", c[0], c[1], c[2]);
  return text + "\n";
}

TEST(Surface, OfEitherObjIsTheSame) {
  expect_tetrahedron(read_surface(wavefront(), "s.obj"));
  expect_tetrahedron(read_surface(mni(), "s.obj"));
  expect_tetrahedron(read_surface(gzipped(mni()), "s.obj.gz"));
  // A face of four corners is two triangles.
  EXPECT_EQ(read_surface("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", "s.obj").triangles,
            (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

std::string binary_stl() {
  std::string bytes = "solid as some programs begin it" + std::string(49, ' ');
  const std::uint32_t count = 4;
  bytes += raw(&count, 1, false);
  for (const auto& c : corners) {
    bytes += std::string(12, '\0');
    for (const std::uint32_t corner : c) bytes += raw(&places[corner][0], 3, false);
    bytes += "\x12\x34";
  }
  return bytes;
}
// As some programs write every triangle, or every face of one colour.
TEST(Surface, TrianglesWithCornersOfTheirOwnHangTogetherInObjAndPlyAsInStl) {
  std::string obj, ply_places, ply_faces, mni_ends, mni_corners;
  int count = 0;
  for (const auto& c : corners) {
    for (const std::uint32_t corner : c) {
      const auto& p = places[corner];
      obj += fmt::format("v {} {} {}\n", p[0], p[1], p[2]);
      ply_places += fmt::format("{} {} {}\n", p[0], p[1], p[2]);
    }
    count += 3;
    obj += "f -3 -2 -1\n", ply_faces += fmt::format("3 {} {} {}\n", count - 3, count - 2, count - 1);
    mni_ends += fmt::format(" {}", count),
        mni_corners += fmt::format(" {} {} {}", count - 3, count - 2, count - 1);
  }
  const Mesh as_stl = read_surface(binary_stl(), "s.stl");
  const auto same = [&](const Mesh& mesh) {
    EXPECT_EQ(mesh.positions, as_stl.positions);
    EXPECT_EQ(mesh.triangles, as_stl.triangles);
    EXPECT_EQ(mesh.labels.size(), 4u);
  };
  same(read_surface(obj, "s.obj"));
  same(
      read_surface("ply\nformat ascii 1.0\nelement vertex 12\nproperty float x\nproperty float y\n"
                   "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n" +
                       ply_places + ply_faces,
                   "s.ply"));
  std::string normals;
  for (int i = 0; i < 12; ++i) normals += " 0 0 1";
  same(read_surface(fmt::format("P 0.3 0.3 0.4 10 1 12\n{}{}\n4\n0 1 1 1 1\n{}\n{}\n", ply_places, normals,
                                mni_ends, mni_corners),
                    "s.obj"));
}

TEST(Surface, ObjThatIsCutOffOrCannotBeIsRefusedWithItsLine) {
  const std::string whole = mni();
  for (std::size_t size = 0; size + 2 < whole.size(); ++size)
    EXPECT_NE(surface_error(whole.substr(0, size)), "") << size;
  EXPECT_NE(surface_error("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n").find("4: a face names vertex '4' of 3"),
            std::string::npos);
  EXPECT_NE(surface_error("v 0 0 0\nv 1 x 0\n").find("2: 'x' is no coordinate"), std::string::npos);
  EXPECT_NE(surface_error("v 0 0 0\nv 1 nan 0\n").find("number 1"), std::string::npos);
  EXPECT_NE(surface_error("v 0 0 0\n").find("no triangle"), std::string::npos);
  EXPECT_NE(surface_error("P 0 0 0 1 1 4000000000\n0 0 0\n").find("4000000000 points"), std::string::npos);
}

// Text, or bytes of either order; what is no place and no corner stands between.
std::string ply(const std::string& format) {
  std::string bytes =
      "ply\nformat " + format +
      " 1.0\ncomment made for a test\nelement before 2\nproperty list uchar short some\nelement vertex 4\n"
      "property float x\nproperty double y\nproperty float nx\nproperty float32 z\nelement face 4\n"
      "property uchar flags\nproperty list uchar int vertex_indices\nproperty list uint8 float "
      "more\nend_header\n";
  const bool text = format == "ascii", big = format == "binary_big_endian";
  const auto add = [&](auto value) { bytes += text ? fmt::format("{} ", value) : raw(&value, 1, big); };
  for (const int some : {7, -7}) add(std::uint8_t(1)), add(std::int16_t(some));
  if (text) bytes += "\n";
  for (const auto& place : places) {
    add(place[0]), add(double(place[1])), add(.5f), add(place[2]);
    if (text) bytes += "\r\n";
  }
  for (const auto& triangle : corners) {
    add(std::uint8_t(9)), add(std::uint8_t(3));
    for (const std::uint32_t corner : triangle) add(std::int32_t(corner));
    add(std::uint8_t(2)), add(1.5f), add(NAN);
    if (text) bytes += "\n";
  }
  return bytes;
}
std::string text_stl() {
  std::string text = "solid made for a test\n";
  for (const auto& c : corners) {
    text += "  facet normal 0 0 1\n    outer loop\n";
    for (const std::uint32_t corner : c)
      text +=
          fmt::format("      vertex {} {} {}\r\n", places[corner][0], places[corner][1], places[corner][2]);
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid made for a test\n";
}
TEST(Surface, OfPlyAndStlIsTheSameAsTextAndAsBytes) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    SCOPED_TRACE(format);
    expect_tetrahedron(read_surface(ply(format), "s.ply"));
    expect_tetrahedron(read_surface(gzipped(ply(format)), "s.ply.gz"));
    EXPECT_TRUE(may_be_surface(ply(format)));
  }
  for (const std::string& stl : {text_stl(), binary_stl()}) {
    expect_tetrahedron(read_surface(stl, "s.stl"));
    expect_tetrahedron(read_surface(gzipped(stl), "s.stl.gz"));
    EXPECT_TRUE(may_be_surface(stl));
  }
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_index\nend_header\n";
  EXPECT_EQ(read_surface(head + "0 0 0 1 0 0 1 1 0 0 1 0 4 0 1 2 3\n", "s.ply").triangles,
            (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Surface, PlyAndStlThatAreCutOffAreRefused) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string whole = ply(format);
    const std::size_t enough = format[0] == 'a' ? whole.size() - 2 : whole.size();  // blanks at the end
    for (std::size_t size = 0; size < enough; ++size) {
      // A text may lose the end of its last number and go unnoticed: "nan" cannot.
      EXPECT_NE(surface_error(whole.substr(0, size)), "") << format << " " << size;
    }
  }
  const std::string text = text_stl(), bytes = binary_stl();
  for (std::size_t size = 0; size < text.find("endsolid") + 8; ++size)
    EXPECT_NE(surface_error(text.substr(0, size)), "") << size;
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_NE(surface_error(bytes.substr(0, size)), "") << size;
  EXPECT_NE(refused<InputError>([&] {
              (void)read_surface(bytes.substr(0, 100), "s.stl");
            }).find("as long as an STL"),
            std::string::npos);
}

TEST(Surface, PlyAndStlThatCannotBeAreRefusedInASentence) {
  const auto ply_error = [&](std::string from, const std::string& to) {
    std::string text = ply("ascii");
    text.replace(text.find(from), from.size(), to);
    return surface_error(text);
  };
  const auto says = [](const std::string& error, const std::string& words) {
    EXPECT_NE(error.find(words), std::string::npos) << error;
  };
  says(ply_error("format ascii", "format pigeon"), "2: its format 'pigeon' is not known");
  says(ply_error("format ascii 1.0\n", ""), "does not say how its values are stored");
  says(ply_error("list uchar short", "list uchar shirt"), "'shirt' is no type of PLY");
  says(ply_error("element vertex 4", "element vertex many"), "no number of how many");
  says(ply_error("element vertex 4", "element vertex 4000000000"), "4000000000 of 'vertex'");
  says(ply_error("element before 2", "element before 18446744073709551615"), "too short");
  says(ply_error("property double y", "property double why"), "vertices without x, y or z");
  says(ply_error("vertex_indices", "corners"), "faces without vertex_indices");
  says(ply_error("-20.5", "x"), "'x' is no number");
  says(ply_error("-20.5", "nan"), "a vertex that is nowhere, number 2");
  says(ply_error("9 3 1 3 2", "9 3 1 3 4"), "triangle 3 names vertex 4 of 4");
  says(ply_error("9 3 1 3 2", "9 3 1 3 -2"), "a corner of -2");
  says(ply_error("9 3 1 3 2", "9 2 1 3"), "fewer than three corners");
  says(ply_error("element before 2", "property float x\nelement before 2"), "before all elements");
  std::string text = text_stl();
  const auto stl_error = [&](std::string from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    return surface_error(changed);
  };
  says(stl_error("-20.5", "south"), "'south' is no coordinate");
  says(stl_error("-20.5", "inf"), "a vertex that is nowhere");
  says(stl_error("    endloop", "vertex 1 2 3\n    endloop"), "7: a facet has more than three corners");
  says(stl_error("      vertex 0 0 0\r\n", ""), "a facet has 2 corners");
  says(surface_error("solid a\nendsolid a\n"), "no triangle");
}

TEST(Surface, AMacaqueIsReadFromObj) {
  FOREST_REAL_DATA(file, "cortex/contour_stacks/macaqueHemi.obj");
  const MappedFile bytes(file);
  const Mesh mesh = read_surface(bytes.text(), file.string());
  EXPECT_EQ(mesh.positions.size(), 27837u);
  EXPECT_EQ(mesh.triangles.size(), 55052u);
}

TEST(Surface, ValuesAreReadFromEveryFormat) {
  const float values[] = {1.5f, -2.f, NAN, 3e-5f};
  const auto expect = [&](const SurfaceValues& read) {
    ASSERT_EQ(read.values.size(), 4u);
    EXPECT_TRUE(read.labels.empty());
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_TRUE(read.values[i] == values[i] || (std::isnan(read.values[i]) && i == 2)) << i;
  };
  expect(read_surface_values(freesurfer_values({1.5f, -2.f, NAN, 3e-5f}), "lh.curv"));
  expect(read_surface_values(freesurfer_values({1.5f, -2.f, INFINITY, 3e-5f}), "lh.curv"));
  expect(read_surface_values(gifti(array("SHAPE", "FLOAT32", value_sizes, "GZipBase64Binary",
                                         base64(deflated(raw(values, 4, false))))),
                             "g"));
  expect(read_surface_values(gifti(array("NONE", "FLOAT32", value_sizes, "ASCII", "1.5 -2 nan 3e-5")), "g"));
  expect(read_surface_values("1.5\n-2\r\n\nnan\n 3e-5", "t.txt"));
  expect(read_surface_values(gzipped("1.5\n-2\nnan\n3e-5\n"), "t.txt.gz"));
  const std::int32_t keys[] = {0, 7, 7, 2};
  const SurfaceValues labels = read_surface_values(
      gifti("<LabelTable><Label Key=\"0\" Red=\"1\" Green=\"1\" Blue=\"1\" Alpha=\"0\">none</Label>"
            "<Label Key=\"7\" Red=\".5\" Green=\"0\" Blue=\"x\" Alpha=\"1\"><![CDATA[V1 & "
            "V2]]></Label></LabelTable>" +
            array("LABEL", "INT32", value_sizes, "Base64Binary", base64(raw(keys, 4, false)))),
      "g");
  EXPECT_EQ(labels.values, (std::vector<float>{0, 7, 7, 2}));
  ASSERT_EQ(labels.labels.size(), 2u);
  EXPECT_EQ(labels.labels[1].name, "V1 & V2");
  EXPECT_EQ(labels.labels[1].key, 7);
  EXPECT_EQ(labels.labels[1].colour, Vec3(.5f, 0.f, .7f));  // "x" is none
  EXPECT_EQ(labels.labels[0].alpha, 0.f);
}

TEST(Surface, AreasOfFreeSurferHaveTheirNamesAndColours) {
  for (const bool numbered : {true, false}) {
    const SurfaceValues areas = read_surface_values(freesurfer_areas(numbered), "lh.economo.annot");
    ASSERT_EQ(areas.values.size(), 3u);
    ASSERT_EQ(areas.labels.size(), 2u);
    EXPECT_EQ(areas.labels[std::size_t(areas.values[1])].name, "FD");
    EXPECT_EQ(areas.labels[std::size_t(areas.values[0])].name, "FA");
    EXPECT_TRUE(std::isnan(areas.values[2]));
    EXPECT_LT((areas.labels[1].colour - Vec3(64, 128, 255) / 255.f).norm(), 1e-6f);
    EXPECT_EQ(areas.labels[0].alpha, 1.f);
    EXPECT_EQ(areas.labels[1].alpha, 0.f);
    const std::string whole = freesurfer_areas(numbered);
    for (std::size_t size = 1; size < whole.size(); ++size)
      EXPECT_NE(values_error(whole.substr(0, size)), "") << size;
    for (std::size_t at = 0; at + 4 <= whole.size(); at += 4)  // sizes that lie
      for (const std::uint32_t lie : {0x7fffffffu, 0x80000000u, 0xffffffffu}) {
        std::string other = whole;
        (void)values_error(other.replace(at, 4, big_endian(lie)));
      }
  }
}

TEST(Surface, WhichPartOfTheBrainIsToldByItsFile) {
  const auto gifti_of = [](const std::string& data) {
    return "<GIFTI><DataArray "
           "Intent=\"NIFTI_INTENT_POINTSET\"><MetaData><MD><Name>AnatomicalStructurePrimary</Name><Value>" +
           data + "</Value></MD></MetaData></DataArray></GIFTI>";
  };
  EXPECT_EQ(surface_structure(gifti_of("CortexRight"), "a.gii"), "CORTEX_RIGHT");
  EXPECT_EQ(surface_structure(gifti_of(""), "x/lh.a.gii"), "CORTEX_LEFT");
  EXPECT_EQ(surface_structure(freesurfer_surface(), "rh.pial"), "CORTEX_RIGHT");
  EXPECT_EQ(surface_structure(freesurfer_surface(), "lh./pial"), "");
}

TEST(Surface, ValuesSayWhatTheyAreWhereTheirFileDoes) {
  const auto title = [](const std::string& bytes, const std::string& name) {
    const SurfaceValues read = read_surface_values(bytes, name);
    EXPECT_EQ(read.values.size(), 2u) << name;
    return read.title;
  };
  EXPECT_EQ(title(write_surface_values("area (mm²)", std::array{1., 2.}), "t.txt"), "area (mm²)");
  EXPECT_EQ(title("1\n2\n", "t.txt"), "");
  EXPECT_EQ(title("#\n#\t depth \r\n# twice\n1\n# between\n2\n", "t.txt"), "depth");
  EXPECT_EQ(title("1\n# late\n2\n", "t.txt"), "");
  EXPECT_EQ(title("# a\x1b[31mb\n1\n2\n", "t.txt"), "a [31mb");
  EXPECT_EQ(title("# " + std::string(200, 'x') + "\n1\n2\n", "t.txt"), std::string(80, 'x'));
  EXPECT_EQ(title(freesurfer_values({1.f, 2.f}), "at/lh.thickness"), "thickness (mm)");
  EXPECT_EQ(title(freesurfer_values({1.f, 2.f}), "lh.other"), "");
  std::string named = gifti(array("SHAPE", "FLOAT32", "Dimensionality=\"1\" Dim0=\"2\"", "ASCII", "1 2"));
  const std::string none = "<MetaData/>";
  named.replace(named.find(none), none.size(),
                "<MetaData><MD><Name>Other</Name><Value>no</Value></MD>"
                "<MD><Name>Name</Name><Value><![CDATA[MyelinMap]]></Value></MD></MetaData>");
  EXPECT_EQ(title(named, "g.shape.gii"), "MyelinMap");
  const auto called = [&](const std::string& path) {
    std::string other = named;
    return title(other.replace(other.find("MyelinMap"), 9, path), "g.shape.gii");
  };
  EXPECT_EQ(called("/data/fsaverage5/surf/lh.thickness"), "thickness (mm)");
  EXPECT_EQ(called("/data/maps/lh.myelin"), "lh.myelin");
  EXPECT_EQ(called("T1w/T2w"), "T1w/T2w");
}

TEST(Surface, EveryFileThatIsCutOffIsAnErrorOrWhole) {
  for (const std::string& whole :
       {freesurfer_surface(), gzipped(freesurfer_surface()), gifti_surface("Base64Binary"),
        gifti_surface("GZipBase64Binary"), gzipped(gifti_surface("GZipBase64Binary"))})
    for (std::size_t size = 0; size + 1 < whole.size(); ++size) {
      const std::string part = whole.substr(0, size);
      // A gzip file without its sum, and XML without its last line end, hold everything.
      if (surface_error(part).empty()) expect_tetrahedron(read_surface(part, "part"));
    }
  const std::string values = freesurfer_values({1, 2, 3});
  for (std::size_t size = 4; size < values.size(); ++size)
    EXPECT_NE(values_error(values.substr(0, size)), "") << size;
}

TEST(Surface, AllMembersOfAPackedFileAreRead) {
  const std::string whole = freesurfer_surface(),
                    parts = gzipped(whole.substr(0, 40)) + gzipped("") + gzipped(whole.substr(40));
  expect_tetrahedron(read_surface(parts, "lh.pial.gz"));
  expect_tetrahedron(read_surface(parts + std::string(512, '\0'), "lh.pial.gz"));
  EXPECT_NE(surface_error(parts.substr(0, parts.size() - 12)).find("cut off"), std::string::npos);
  EXPECT_NE(surface_error(parts + "more").find("other bytes after"), std::string::npos);
}

TEST(Surface, SizesThatLieCostNoMemory) {
  std::string bytes =
      "\xff\xff\xfe"
      "a\n\n" +
      big_endian(0x7fffffffu) + big_endian(0x7fffffffu);
  EXPECT_NE(surface_error(bytes).find("cut off"), std::string::npos);
  bytes =
      "\xff\xff\xfe"
      "a\n\n" +
      big_endian(0x80000000u) + big_endian(1u);
  EXPECT_NE(surface_error(bytes).find("-2147483648 vertices"), std::string::npos);
  EXPECT_NE(values_error("\xff\xff\xff" + big_endian(0x7fffffffu) + big_endian(1u) + big_endian(1u)), "");
  EXPECT_NE(values_error("\xff\xff\xff" + big_endian(1u) + big_endian(1u) + big_endian(3u)).find("3 values"),
            std::string::npos);
  const std::string data = base64(deflated(std::string(48, 'a')));
  for (const auto& [sizes, what] :
       {std::pair("Dimensionality=\"2\" Dim0=\"200000000\" Dim1=\"3\"", "268,435,456"),
        std::pair("Dimensionality=\"2\" Dim0=\"90000000\" Dim1=\"2\"", "bytes"),
        std::pair("Dimensionality=\"2\" Dim0=\"99999999999999999999\" Dim1=\"3\"", "Dim0"),
        std::pair("Dimensionality=\"2\" Dim0=\"-4\" Dim1=\"3\"", "Dim0"),
        std::pair("Dimensionality=\"2\" Dim0=\"4\"", "Dim1"), std::pair("Dimensionality=\"0\"", "dimension"),
        std::pair("Dimensionality=\"6\" Dim0=\"4\" Dim1=\"100000\" Dim2=\"100000\" Dim3=\"1\" Dim4=\"1\" "
                  "Dim5=\"1\"",
                  "268")})
    for (const char* encoding : {"GZipBase64Binary", "Base64Binary", "ASCII"}) {
      const std::string error = values_error(gifti(array("SHAPE", "FLOAT32", sizes, encoding, data)));
      EXPECT_NE(error, "") << sizes;
      if (encoding[0] == 'G') {
        EXPECT_NE(error.find(what), std::string::npos) << error;
      }
    }
  // What unpacks to more than it says is not unpacked to its end.
  EXPECT_NE(values_error(gifti(array("SHAPE", "FLOAT32", value_sizes, "GZipBase64Binary",
                                     base64(deflated(std::string(1 << 20, 'a'))))))
                .find("more than it says"),
            std::string::npos);
}

TEST(Surface, WhatCannotBeIsRefusedWithOneSentence) {
  std::string bytes = freesurfer_surface();
  bytes.replace(bytes.size() - 4, 4, big_endian(4u));
  EXPECT_EQ(surface_error(bytes), "s: triangle 3 names vertex 4 of 4; get the whole file");
  bytes.replace(bytes.size() - 4, 4, big_endian(0xffffffffu));
  EXPECT_NE(surface_error(bytes), "");
  for (const float wrong : {NAN, INFINITY, -2e8f})
    for (std::size_t i = 0; i < 12; ++i) {
      bytes = freesurfer_surface();
      bytes.replace(bytes.size() - 96 + 4 * i, 4, big_endian(wrong));
      EXPECT_NE(surface_error(bytes).find("a vertex that is nowhere"), std::string::npos)
          << wrong << " at " << i;
    }
  EXPECT_NE(surface_error("\xff\xff\xfe"
                          "a\n\n" +
                          big_endian(0u) + big_endian(0u)),
            "");
  const std::string points = array("POINTSET", "FLOAT32", point_sizes, "ASCII", "0 0 0 1 0 0 0 1 0 0 0 1");
  for (const char* triangles :
       {"0 1 2 0 1 3 0 2 3 1 2 4", "0 1 2 0 1 3 0 2 3 1 2 -1", "0 1 2 0 1 3 0 2 3 1 2 nan",
        "0 1 2 0 1 3 0 2 3 1 2 1e30", "0 1 2 0 1 3 0 2 3 1 2", "0 1 2 0 1 3 0 2 3 1 2 3 3",
        "0 1 2 0 1 3 0 2 3 1 2 x", ""})
    EXPECT_NE(surface_error(gifti(points + array("TRIANGLE", "INT32", point_sizes, "ASCII", triangles))), "")
        << triangles;
  EXPECT_NE(surface_error(gifti(points)).find("TRIANGLE"), std::string::npos);
  EXPECT_NE(surface_error(gifti("")).find("POINTSET"), std::string::npos);
  EXPECT_NE(values_error(gifti(points)).find("no values"), std::string::npos);
  EXPECT_NE(surface_error(gifti(array("POINTSET", "COMPLEX64", point_sizes, "ASCII", "0"))).find("COMPLEX64"),
            std::string::npos);
  EXPECT_NE(values_error(gifti(array("SHAPE", "FLOAT32", value_sizes, "ExternalFileBinary", "")))
                .find("another file"),
            std::string::npos);
  EXPECT_NE(
      values_error(gifti(array("SHAPE", "FLOAT32", value_sizes, "Base64Binary", "????"))).find("base64"),
      std::string::npos);
  EXPECT_NE(values_error(gifti(array("SHAPE", "FLOAT32", point_sizes, "ASCII", "0 0 0 1 0 0 0 1 0 0 0 1")))
                .find("3 values"),
            std::string::npos);
  EXPECT_NE(surface_error("<GIFTI><DataArray>").find("XML"), std::string::npos);
  for (const char* other : {"", "1 2 3", "# vtk DataFile", "\x1f\x8bnothing", "\xff\xff\xfd"})
    EXPECT_NE(surface_error(other), "") << other;
  for (const char* other : {"", "a\n", "1 2\n"}) EXPECT_NE(values_error(other), "") << other;
  EXPECT_EQ(values_error("1\ntwo\x1b[2J\n").find('\x1b'), std::string::npos);
  // Elements within one another cost no stack.
  std::string deep = "<GIFTI>";
  for (int i = 0; i < 200'000; ++i) deep += "<a>";
  EXPECT_NE(surface_error(deep), "");
}

/// Kept inputs of the fuzzer: each once crashed a reader or leads far into one.
TEST(Surface, TheFuzzersCorpusIsReadOrRefused) {
  std::size_t read = 0;
  for (const auto& entry : std::filesystem::directory_iterator(FOREST_SOURCE_DIR "/fuzz/corpus/surface")) {
    SCOPED_TRACE(entry.path().filename().string());
    const MappedFile file(entry.path());
    read += surface_error(std::string(file.text())).empty() + values_error(std::string(file.text())).empty();
  }
  EXPECT_GE(read, 14u);  // those that it began with
}

TEST(Surface, RealFilesAreWhatTheirAtlasesSay) {
  FOREST_REAL_DATA(folder, "cortex");
  const auto read = [&](const char* file) { return MappedFile(folder / file); };
  const MappedFile pial_file = read("fsaverage5/pial_left.gii.gz"),
                   white_file = read("fsaverage5/white_left.gii.gz");
  const Mesh pial = read_surface(pial_file.text(), "pial"), white = read_surface(white_file.text(), "white");
  EXPECT_EQ(pial.positions.size(), 10242u);
  EXPECT_EQ(pial.triangles.size(), 20480u);
  EXPECT_TRUE(is_closed(pial));
  EXPECT_EQ(count_pieces(pial), 1u);
  EXPECT_EQ(pial.triangles, white.triangles);
  // An average hemisphere: some 500 cm³ within the pia, more than within the white surface; µm³.
  EXPECT_GT(volume(pial) / 1e12, 400.);
  EXPECT_LT(volume(pial) / 1e12, 650.);
  EXPECT_LT(volume(white), volume(pial));
  const SurfaceValues thickness =
      read_surface_values(read("fsaverage5/thick_left.gii.gz").text(), "thickness");
  ASSERT_EQ(thickness.values.size(), 10242u);
  double sum = 0.;
  for (std::size_t i = 0; i < 10242; ++i)
    sum += double((pial.positions[i] - white.positions[i]).norm()) / 1000. - double(thickness.values[i]);
  EXPECT_NEAR(sum / 10242., 0., .5);  // mm
  for (const char* file :
       {"fs_LR_left/fs_LR.32k.L.pial.surf.gii", "bigbrain_left/tpl-bigbrain_hemi-L_desc-pial.surf.gii.gz",
        "fsaverage5/flat_left.gii.gz"}) {
    const MappedFile one = read(file);
    EXPECT_GT(read_surface(one.text(), file).triangles.size(), 18000u) << file;
  }
  EXPECT_EQ(
      read_surface_values(read("bigbrain_left/tpl-bigbrain_hemi-L_desc-layer1_thickness.txt.gz").text(), "t")
          .values.size(),
      163842u);
}

}  // namespace
}  // namespace forest::io
