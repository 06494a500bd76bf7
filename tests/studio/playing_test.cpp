// SPDX-License-Identifier: Apache-2.0
// A simulation that plays, its traces and raster, and synapses.
#include "forest/core/file.h"
#include "forest/reports/trace.h"
#include "forest/scene/playback.h"
#include "forest/scene/synapses.h"

#include "tests/studio/driven_studio.h"

namespace forest::studio {
namespace {

class Playing : public Window {
 protected:
  std::vector<std::string> more() const override { return {"--activity", sample_activity()}; }
  double time() const { return activity_.at("time").get<double>(); }
};

// What was written whole is damaged later, by a disk or on its way: the header is right, values are not.
class PlayingDamaged : public Window {
 protected:
  std::vector<std::string> more() const override {
    std::string bytes = std::string(MappedFile(sample_activity()).text());
    for (std::size_t i = bytes.size() / 3; i < bytes.size() / 2; ++i) bytes[i] = char(~bytes[i]);
    write_file(folder / "damaged.activity", bytes);
    return {"--activity", folder / "damaged.activity"};
  }
};

class Contacts : public Window {
 protected:
  std::vector<std::string> more() const override { return {"--synapses", sample_synapses()}; }
};

TEST_F(Playing, SpacePlaysAndStopsAndStepsGoBothWays) {
  key("o");  // no outline
  settle();
  EXPECT_EQ(time(), 0.);
  EXPECT_FALSE(activity_.at("playing").get<bool>());
  const io::Picture first = saved("moment_0.png");
  key("period period period");
  settle();
  EXPECT_NEAR(time(), 1.5, 1e-6);
  EXPECT_NEAR(view_.activity.value().time.value(), 1.5, 1e-6);
  key("comma");
  settle();
  EXPECT_NEAR(time(), 1., 1e-6);
  xdotool("key space sleep 0.8 key space");
  settle();
  EXPECT_FALSE(activity_.at("playing").get<bool>());
  EXPECT_GT(time(), 3.);
  EXPECT_LT(time(), 149.5);
  // Wherever it stopped, that moment is seen, and not the first one.
  scene::Playback playback = scene::Playback::open(sample(), sample_activity());
  const io::Picture later = saved("moment_later.png"),
                    alone = without_a_window(view_, later.width, later.height, &playback);
  EXPECT_LT(difference(later, alone), .001);
  EXPECT_LT(4. * difference(later, alone), difference(first, later));
  key("ctrl+Home");
  settle();
  EXPECT_EQ(time(), 0.);
  EXPECT_EQ(saved("moment_again.png").pixels, first.pixels);
}

TEST_F(Playing, WhatIsSetInAPanelLeavesTheMomentAlone) {
  key("period period period");
  settle();
  key("alt+r");
  xdotool("key ctrl+a type --delay 5 '2'");
  key("Return");
  settle();
  EXPECT_EQ(view_.detail.error, 2.f);
  EXPECT_NEAR(time(), 1.5, 1e-6);
}

TEST_F(PlayingDamaged, PutsTheSimulationAwayAndGoesOn) {
  EXPECT_TRUE(activity_.is_null());  // its raster was to be drawn
  key("space period");               // nothing plays
  settle();
  const scene::View before = view_;
  drag(1, {100, 150}, {160, 160});
  EXPECT_NE(view_.camera.eye, before.camera.eye);
  key("ctrl+Home");
}

TEST_F(Playing, AClickShowsTheWholeHistoryOfTheCompartmentAndTracesAreSaved) {
  const scene::Playback playback = scene::Playback::open(sample(), sample_activity());
  Random random(21);
  std::vector<reports::Trace> wanted;
  for (int i = 0; i < 3; ++i) {
    // A place where half a pixel more or less is still the same compartment.
    Target target;
    std::optional<scene::Playback::Compartment> compartment, beside;
    do {
      target = clear_target(random, view_, viewport(), true);
      const std::array middle{Vec2(target.pixel + Vec2(.5f, .5f))};
      const auto rough = scene::plain_picks(sample(), view_.camera, viewport(), middle, .5f)[0];
      compartment = playback.compartment(target.pick->instance, target.pick->segment);
      beside = playback.compartment(rough->instance, rough->segment);
    } while (compartment->index != beside->index);
    const reports::Trace trace = reports::trace(playback.activity(), compartment->row, compartment->index);
    const auto again = std::ranges::find_if(
        wanted, [&](const auto& t) { return t.row == trace.row && t.compartment == trace.compartment; });
    if (again != wanted.end()) wanted.erase(again);
    wanted.push_back(trace);
    xdotool("mousemove " + place(target.pixel) + " click 1");
    const Json clamped = studio_->wait_for("clamped");
    ASSERT_EQ(clamped.at("traces").size(), wanted.size());
    EXPECT_EQ(clamped.at("traces").back(), trace.name());
    // Under the number that the selection has.
    const Json section = studio_->wait_for("selected").at("facts").at("section");
    EXPECT_EQ(section, target.pick->section == scene::soma_section ? Json("soma") : Json(trace.section));
    finish();
  }
  const auto path = folder / "traces.csv";
  std::filesystem::remove(path);
  key("ctrl+t");
  xdotool("search --sync --onlyvisible --name 'Save traces' windowfocus");
  xdotool(fmt::format("key ctrl+a type --delay 5 '{}'", path.string()));
  key("Return");
  wait_for_file(path, "Save traces");
  EXPECT_EQ(MappedFile(path).text(), reports::csv_of(playback.activity().facts(), wanted));
}

TEST_F(Playing, AClickOnARowOfTheRasterSelectsItsNeuron) {
  const scene::Playback playback = scene::Playback::open(sample(), sample_activity());
  const Json raster = activity_.at("raster");
  const auto rows = playback.activity().rows();
  for (const double share : {.1, .5, .93}) {
    const int y = int(share * raster.at("height").get<double>());
    xdotool(fmt::format("mousemove {} {} click 1", raster.at("x").get<int>() + 40,
                        raster.at("y").get<int>() + y));
    studio_->wait_for("clamped");  // the soma's voltage is shown, too
    const Json facts = studio_->wait_for("selected").at("facts");
    const auto row = std::size_t((double(y) + .5) / raster.at("height").get<double>() * double(rows.size()));
    EXPECT_NEAR(facts.at("neuron").get<int>(), int(rows[row].instance), 1);
    EXPECT_EQ(facts.at("section"), "soma");
    finish();
  }
}

TEST_F(Playing, ASelectedSectionHasAWhiteRimAndKeepsTheColourOfItsValue) {
  Random random(22);
  Target target;
  RoundCone branch;
  do {  // so wide that its middle is no rim
    target = clear_target(random, view_, viewport(), true);
    branch = scene::in_world(sample(), target.pick->instance, target.pick->segment);
  } while (std::min(branch.radius_a, branch.radius_b) <
           3.f * view_.camera.pixel_size(viewport().height, float(target.pick->distance)));
  const auto white = [](const io::Picture& p, std::size_t x, std::size_t y) {
    const std::uint8_t* pixel = &p.pixels[4 * (y * p.width + x)];
    return std::min({pixel[0], pixel[1], pixel[2]}) > 130;
  };
  const auto x = std::size_t(target.pixel.x()), y = std::size_t(target.pixel.y());
  const auto around = [&](const io::Picture& p) {
    std::size_t count = 0;
    for (std::size_t j = y > 40 ? y - 40 : 0; j < std::min<std::size_t>(y + 40, p.height); ++j)
      for (std::size_t i = x > 40 ? x - 40 : 0; i < std::min<std::size_t>(x + 40, p.width); ++i)
        count += white(p, i, j);
    return count;
  };
  const io::Picture before = saved("rim_before.png");
  click(target.pixel);
  finish();
  const io::Picture after = saved("rim.png");
  EXPECT_GT(around(after), around(before) + 10);
  EXPECT_FALSE(white(after, x, y));
}

TEST_F(Playing, AViewCopiedWithItsMomentGoesBackThere) {
  key("period period");
  settle();
  key("ctrl+c");
  key("ctrl+Home");
  settle();
  EXPECT_EQ(time(), 0.);
  key("ctrl+v");
  settle();
  EXPECT_NEAR(time(), 1., 1e-6);
}

TEST_F(Contacts, AreShownUntilAKeyHidesThem) {
  EXPECT_GT(synapses_, 100u);
  const io::Picture with = saved("synapses.png");
  key("y");
  settle();
  EXPECT_EQ(synapses_, 0u);
  EXPECT_EQ(view_.synapses, scene::SynapseColour::none);
  EXPECT_GT(difference(with, saved("no_synapses.png")), .001);
  key("y");
  key("shift+y");
  settle();
  EXPECT_GT(synapses_, 100u);
  EXPECT_EQ(view_.synapses, scene::SynapseColour::target);
}

TEST_F(Contacts, AClickTellsSourceAndTarget) {
  const auto synapses = scene::Synapses::open(sample_synapses(), sample());
  const scene::Eye eye(view_.camera, viewport(), {});
  const auto choice =
      synapses.choose(eye, scene::colour(sample(), scene::ColourBy::type, scene::Background::dark),
                      scene::SynapseColour::sign);
  int clicked = 0;
  for (std::size_t i = 0; i < choice.balls.size() && clicked < 3; ++i) {
    const Vec3 at = frame::project(view_.camera, viewport(), choice.balls[i].centre);
    const Vec2 pixel(std::floor(at.x()), std::floor(at.y()));
    if (pixel.x() < 250 || pixel.x() > viewport().width - 60 || pixel.y() < 60 ||
        pixel.y() > viewport().height - 120)
      continue;
    const auto found = scene::pick(choice, view_.camera, viewport(), pixel + Vec2(.5f, .5f), 1.5f);
    const auto branch = scene::pick(sample(), view_.camera, viewport(), pixel + Vec2(.5f, .5f), 0.f);
    if (!found || found->synapse != choice.synapses[i] || (branch && branch->distance < found->distance))
      continue;
    const scene::Synapse& synapse = synapses.all()[found->synapse];
    const Json facts = click(pixel);
    ASSERT_TRUE(facts.contains("synapse")) << facts.dump();
    EXPECT_EQ(facts["synapse"]["synapse"], synapse.id);
    EXPECT_EQ(facts["synapse"]["source"], synapse.source);
    EXPECT_EQ(facts["synapse"]["target"], synapse.target);
    EXPECT_EQ(facts["neuron"], synapse.target);
    settle();
    ++clicked;
  }
  EXPECT_GT(clicked, 0);
}

}  // namespace
}  // namespace forest::studio
