// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/selection.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/scene/view.h"

namespace forest::studio {
namespace {

using Json = nlohmann::ordered_json;

struct Subject {
  const scene::Forest& forest;
  const Selection& selection;
  const frame::Instance& instance;
  const scene::Neuron& neuron;
  const scene::SectionFacts* section;  // null for the soma

  std::uint32_t index() const { return selection.pick.instance; }
  const circuit::Circuit& circuit() const { return forest.circuit(); }
  const circuit::NodeRun& run() const {  // of nodes, in which it is
    return *std::ranges::find_if(forest.nodes().runs,
                                 [&](const auto& r) { return index() - r.first_instance < r.count; });
  }
  std::uint32_t section_of(std::uint32_t segment) const {
    return forest.section_of_segment()[neuron.first_original + segment - neuron.first_segment];
  }
  std::set<std::uint32_t> sections() const {  // of the subarbor
    std::set<std::uint32_t> found;
    for (const std::uint32_t s : selection.subarbor)
      if (section_of(s) != scene::soma_section) found.insert(section_of(s));
    return found;
  }
  template <class Value>
  auto sum(Value value) const {  // over the sections of the subarbor
    decltype(value(*section)) total = 0;
    for (const std::uint32_t s : sections()) total += value(forest.sections()[neuron.first_section + s]);
    return total;
  }
};

Subject subject(const scene::Forest& forest, const Selection& selection) {
  const frame::Instance& instance = forest.instances()[selection.pick.instance];
  const scene::Neuron& neuron = forest.neurons()[instance.morphology];
  return {forest, selection, instance, neuron,
          selection.is_soma() ? nullptr : &forest.sections()[neuron.first_section + selection.pick.section]};
}

double tidy(float value) { return std::round(double(value) * 1000.) / 1000.; }

// One row feeds the panel, the JSON and the documentation. A null value: the row does not apply.
template <class Of>
struct Row {
  const char* key;
  const char* name;
  const char* unit;
  const char* hint;
  Json (*value)(const Of&);
};
constexpr std::uint32_t none = 0xffffffffu;
const Row<Subject> rows[] = {
    {"neuron", "Neuron", "", "Number of the planted neuron in the forest, from 0",
     [](const Subject& s) { return Json(s.index()); }},
    {"population", "Population", "", "Of the circuit, as SONATA calls it",
     [](const Subject& s) { return Json(s.forest.nodes().populations[s.run().population]); }},
    {"node_id", "Node", "", "Its number in its population: what reports and 'clamp --neuron' call it",
     [](const Subject& s) { return Json(s.run().first_node + s.index() - s.run().first_instance); }},
    {"type", "Cell type", "", "From the recipe of the column",
     [](const Subject& s) { return Json(s.circuit().types[s.forest.types()[s.index()]].name); }},
    {"section", "Section", "", "Id of the section within its neuron, from 0",
     [](const Subject& s) { return s.section ? Json(s.selection.pick.section) : Json("soma"); }},
    {"kind", "Kind", "", "Axon, basal or apical dendrite, …",
     [](const Subject& s) { return s.section ? Json(name_of(SectionKind(s.section->kind))) : Json("soma"); }},
    {"order", "Branch order", "", "Branch points between the section and the soma: 0 for a stem",
     [](const Subject& s) { return s.section ? Json(s.section->order) : Json(); }},
    {"length", "Length", "µm", "Of the section, along its path",
     [](const Subject& s) { return s.section ? Json(tidy(s.section->length)) : Json(); }},
    {"diameter_start", "Diameter, start", "µm", "Where the section begins",
     [](const Subject& s) { return s.section ? Json(tidy(s.section->diameter_start)) : Json(); }},
    {"diameter_end", "Diameter, end", "µm", "Where the section ends",
     [](const Subject& s) { return s.section ? Json(tidy(s.section->diameter_end)) : Json(); }},
    {"diameter", "Soma diameter", "µm", "Of the sphere of the same place and mean size",
     [](const Subject& s) { return s.section ? Json() : Json(tidy(2.f * s.neuron.soma_radius)); }},
    {"path_distance", "Path distance", "µm", "Along the branches, from the soma to the section's end",
     [](const Subject& s) { return s.section ? Json(tidy(s.section->path_distance)) : Json(); }},
    {"parent", "Parent section", "", "The section that it grows out of (key P selects it)",
     [](const Subject& s) {
       return !s.section ? Json() : s.section->parent == none ? Json("soma") : Json(s.section->parent);
     }},
    {"daughters", "Daughters", "", "Sections that grow out of its end: 0 for a terminal, 2 at a bifurcation",
     [](const Subject& s) { return s.section ? Json(s.section->daughters) : Json(); }},
    {"subarbor_sections", "Subarbor sections", "", "The section and all that grows out of it",
     [](const Subject& s) { return Json(s.sections().size()); }},
    {"subarbor_tips", "Subarbor tips", "", "Its terminals",
     [](const Subject& s) { return Json(s.sum([](const auto& f) { return int(f.daughters == 0); })); }},
    {"subarbor_length", "Subarbor length", "µm", "Sum over its sections",
     [](const Subject& s) { return Json(tidy(s.sum([](const auto& f) { return f.length; }))); }},
    {"layer", "Layer", "", "Where its soma lies",
     [](const Subject& s) { return Json(s.circuit().layers[s.forest.layers()[s.index()]].name); }},
    {"morphology", "Morphology", "", "Name of the grown or traced neuron that stands here",
     [](const Subject& s) { return Json(s.circuit().morphologies[s.instance.morphology]); }},
    {"position", "Soma position", "µm", "x, y, z in the tissue; y points to the pia",
     [](const Subject& s) {
       return Json{tidy(s.instance.x), tidy(s.instance.y), tidy(s.instance.z)};
     }},
};

std::string in_words(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_array())
    return fmt::format("{:.1f}, {:.1f}, {:.1f}", value[0].get<float>(), value[1].get<float>(),
                       value[2].get<float>());
  if (value.is_number_float()) return fmt::format("{:.2f}", value.get<float>());
  return value.dump();
}

}  // namespace

Selection select(const scene::Forest& forest, const scene::Pick& pick) {
  return {pick, scene::subarbor(forest, pick.instance, pick.section)};
}

std::optional<scene::Pick> parent_of(const scene::Forest& forest, const scene::Pick& pick) {
  if (pick.section == scene::soma_section) return std::nullopt;
  const scene::Neuron& neuron = forest.neurons()[forest.instances()[pick.instance].morphology];
  scene::Pick parent = pick;
  parent.section = forest.sections()[neuron.first_section + pick.section].parent;  // all ones: the soma
  static_assert(none == scene::soma_section);
  const auto sections = forest.section_of_segment().subspan(neuron.first_original, neuron.original_count);
  const auto first = std::ranges::find(sections, parent.section);
  if (first == sections.end()) return std::nullopt;  // a neuron without soma
  parent.segment = neuron.first_segment + std::uint32_t(first - sections.begin());
  return parent;
}

std::vector<Fact> facts(const scene::Forest& forest, const Selection& selection) {
  const Subject s = subject(forest, selection);
  std::vector<Fact> known;
  for (const auto& row : rows)
    if (const Json value = row.value(s); !value.is_null())
      known.push_back({row.name, row.unit, row.hint, in_words(value)});
  return known;
}

nlohmann::ordered_json to_json(const scene::Forest& forest, const Selection& selection) {
  const Subject s = subject(forest, selection);
  Json json;
  for (const auto& row : rows)
    if (Json value = row.value(s); !value.is_null()) json[row.key] = std::move(value);
  json["segment"] = selection.pick.segment - s.neuron.first_segment;
  return json;
}

void add_marks(const RoundCone& branch, std::uint32_t entry, std::vector<frame::Overlay>& to) {
  constexpr float step = 1.06f;  // between the radii of two marks
  constexpr int most = 32;
  const auto [thin, thick] = std::minmax(branch.radius_a, branch.radius_b);
  const float ratio = thick / std::max(thin, .01f * thick + 1e-6f);
  const int count = std::clamp(int(std::ceil(std::log(ratio) / std::log(step))), 1, most);
  for (int i = 0; i < count; ++i) {
    const float from = float(i) / float(count), end = float(i + 1) / float(count);
    const auto radius = [&](float t) { return branch.radius_a + t * (branch.radius_b - branch.radius_a); };
    to.push_back({branch.a + from * (branch.b - branch.a), branch.a + end * (branch.b - branch.a),
                  std::max(radius(from), radius(end)), entry});
  }
}

std::vector<frame::Overlay> highlight(const scene::Forest& forest, const Selection& selection) {
  const Subject s = subject(forest, selection);
  std::vector<frame::Overlay> marks;
  const auto mark = [&](bool section, std::uint32_t entry) {
    for (const std::uint32_t segment : selection.subarbor) {
      if ((s.section_of(segment) == selection.pick.section) != section || marks.size() >= most_marks)
        continue;
      RoundCone cone = scene::in_world(forest, s.index(), segment);
      cone.radius_a = 1.02f * cone.radius_a + .01f, cone.radius_b = 1.02f * cone.radius_b + .01f;
      add_marks(cone, entry, marks);
    }
  };
  mark(true, scene::section_entry);
  mark(false, scene::highlight_entry);
  return marks;
}

std::optional<scene::Pick> pick_spine(scene::Skin& skin, const scene::Forest& forest,
                                      const frame::Camera& camera, const frame::Viewport& viewport,
                                      const Vec2& place, const std::function<bool(std::uint32_t)>& has_skin) {
  constexpr float longest_spine = 4.f, reach = 1.f;  // µm; pixels that a spine is widened by
  const Ray ray = ray_through(camera, viewport, place);
  const auto pixels = [&](float depth) { return 1.f / camera.pixel_size(viewport.height, depth); };  // a µm
  const Vec3 forward = -camera.axes().col(2);
  std::optional<scene::Pick> nearest;
  for (std::uint32_t i = 0; i < forest.instances().size(); ++i) {
    const frame::Instance& instance = forest.instances()[i];
    const scene::Neuron& neuron = forest.neurons()[instance.morphology];
    if (!neuron.cluster_count || !has_skin(i)) continue;
    const Quat turn(instance.qw, instance.qx, instance.qy, instance.qz);
    const Vec3 at(instance.x, instance.y, instance.z);
    const auto in_world = [&](const Vec3& p) -> Vec3 { return at + turn * p; };
    const scene::Cluster& all = forest.clusters()[neuron.first_cluster];
    const Vec3 to = in_world({all.x, all.y, all.z}) - ray.origin;
    const float room = all.radius + longest_spine, along = to.dot(ray.direction);
    if (pixels(std::max(camera.near, to.dot(forward) - room)) < scene::spines_begin ||
        (to - along * ray.direction).squaredNorm() > room * room)
      continue;
    for (const scene::Spine& spine : skin.spines(instance.morphology)) {
      const Vec3 tip = in_world(spine.tip), beside = tip - ray.origin;
      const float depth = (tip - camera.eye).dot(forward);
      if (depth < camera.near || pixels(depth) < scene::spines_begin ||
          beside.cross(ray.direction).squaredNorm() > longest_spine * longest_spine)
        continue;
      const float wider = reach / pixels(depth);
      const RoundCone neck{in_world(spine.base), tip, spine.neck + wider, spine.neck + wider},
          head{tip, tip, spine.head + wider, spine.head + wider};
      for (const RoundCone& part : {neck, head})
        if (const auto t = intersect(ray, part); t && (!nearest || double(*t) < nearest->distance))
          nearest = {i, neuron.first_segment + spine.segment,
                     forest.section_of_segment()[neuron.first_original + spine.segment], double(*t)};
    }
  }
  return nearest;
}

Sphere around(const scene::Forest& forest, const Selection& selection) {
  Bounds bounds;
  for (const std::uint32_t segment : selection.subarbor) {
    const RoundCone cone = scene::in_world(forest, selection.pick.instance, segment);
    bounds.add(cone.a, cone.radius_a);
    bounds.add(cone.b, cone.radius_b);
  }
  return {bounds.centre(), .5f * bounds.extent().norm()};
}

namespace {

struct Contact {
  const scene::Synapses& synapses;
  const scene::Synapse& synapse;
  std::uint32_t number;
  const scene::ProjectionFacts& projection;

  bool planted() const { return !(synapse.flags & scene::Synapse::outside); }
};
Contact contact(const scene::Synapses& all, std::uint32_t number) {
  const scene::Synapse& synapse = all.all()[number];
  return {all, synapse, number, all.projection(synapse)};
}

const Row<Contact> contact_rows[] = {
    {"synapse", "Synapse", "", "Its number among the edges of its population, from 0",
     [](const Contact& c) { return Json(c.synapse.id - c.projection.first); }},
    {"sign", "Sign", "", "Whether it excites or inhibits",
     [](const Contact& c) { return Json(circuit::name_of(c.synapse.sign())); }},
    {"source", "Source", "",
     "The neuron whose axon makes it: its id, or its number in a population that is not planted",
     [](const Contact& c) {
       return c.planted() ? Json(c.synapse.source)
                          : Json(fmt::format("{} {}", c.projection.source, c.synapse.source));
     }},
    {"source_type", "Source type", "", "Cell type of the source",
     [](const Contact& c) {
       const scene::Forest& forest = c.synapses.forest();
       return c.planted() ? Json(forest.circuit().types[forest.types()[c.synapse.source]].name) : Json();
     }},
    {"target", "Target", "", "The neuron that it is on",
     [](const Contact& c) { return Json(c.synapse.target); }},
    {"along", "Along the section", "", "0 at its beginning, 1 at its end",
     [](const Contact& c) { return Json(tidy(float(c.synapse.position) / 65535.f)); }},
    {"projection", "Projection", "", "Population of edges, as the circuit names it; what is made up says so",
     [](const Contact& c) { return Json(c.projection.name); }},
};

}  // namespace

std::vector<Fact> facts(const scene::Synapses& synapses, std::uint32_t synapse) {
  const Contact c = contact(synapses, synapse);
  std::vector<Fact> known;
  for (const auto& row : contact_rows)
    if (const Json value = row.value(c); !value.is_null())
      known.push_back({row.name, row.unit, row.hint, in_words(value)});
  return known;
}

nlohmann::ordered_json to_json(const scene::Synapses& synapses, std::uint32_t synapse) {
  const Contact c = contact(synapses, synapse);
  Json json;
  for (const auto& row : contact_rows)
    if (Json value = row.value(c); !value.is_null()) json[row.key] = std::move(value);
  return json;
}

}  // namespace forest::studio
