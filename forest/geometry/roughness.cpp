// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/roughness.h"

#include <algorithm>
#include <cmath>

#include "forest/core/random.h"

namespace forest {
namespace {

using Signal = Eigen::Vector4d;  // a place, and a number that is noise

// Less the mean over the neighbours. In a closed mesh every edge is passed once in each direction.
std::vector<Signal> sharpened(const std::vector<Signal>& signal, const Mesh& mesh) {
  std::vector<Signal> sum(signal.size(), Signal::Zero());
  std::vector<int> count(signal.size(), 0);
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) sum[t[k]] += signal[t[(k + 1) % 3]], ++count[t[k]];
  for (std::size_t v = 0; v < signal.size(); ++v)
    sum[v] = count[v] ? Signal(signal[v] - sum[v] / count[v]) : Signal::Zero();
  return sum;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

double roughness(const Mesh& mesh) {
  if (mesh.triangles.empty()) return 0.;
  std::vector<Signal> signal(mesh.positions.size());
  for (std::size_t v = 0; v < signal.size(); ++v)
    signal[v] << mesh.positions[v].cast<double>(), Random(1, v).normal();
  for (int i = 0; i < 3; ++i) signal = sharpened(signal, mesh);

  std::vector<std::uint8_t> used(signal.size(), 0);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) used[v] = 1;
  const auto normals = vertex_normals(mesh);
  std::vector<double> of_surface, of_noise;
  for (std::size_t v = 0; v < signal.size(); ++v)
    if (used[v]) {
      of_surface.push_back(std::abs(signal[v].head<3>().dot(normals[v].cast<double>())));
      of_noise.push_back(std::abs(signal[v][3]));
    }
  return median(of_surface) / median(of_noise);
}

}  // namespace forest
