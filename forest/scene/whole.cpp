// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/whole.h"

namespace forest::scene {

Cut whole(const Forest& forest, const frame::Camera& camera, const frame::Viewport& viewport) {
  const frame::Frustum frustum(camera, viewport);
  Cut cut;
  for (std::uint32_t index = 0; index < forest.instances().size(); ++index) {
    const frame::Instance& instance = forest.instances()[index];
    const Neuron& neuron = forest.neurons()[instance.morphology];
    const Vec3 place(instance.x, instance.y, instance.z);
    const Quat turn(instance.qw, instance.qx, instance.qy, instance.qz);
    for (const Cluster& c : forest.clusters().subspan(neuron.first_cluster, neuron.cluster_count)) {
      const Sphere sphere{place + turn * Vec3(c.x, c.y, c.z), c.radius};
      if (!c.is_leaf() || !frustum.may_see(sphere)) continue;
      cut.capsules.push_back({index, c.first_segment, c.all(), 0, sphere.centre.x(), sphere.centre.y(),
                              sphere.centre.z(), sphere.radius});
      cut.segments += c.segment_count;
    }
  }
  cut.bands = {{0, 0, std::uint32_t(cut.capsules.size())}};
  return cut;
}

}  // namespace forest::scene
