// SPDX-License-Identifier: Apache-2.0
// Looking at a forest: selecting, moving, targets, gaze, panels.
#include <map>
#include <set>

#include "forest/core/file.h"

#include "tests/studio/driven_studio.h"

namespace forest::studio {
namespace {

class Near : public Window {
 protected:
  float nearness() const override { return .06f; }
};

// Drawn by OpenGL, of which the driver can be made to say that the card was reset.
class OnACard : public Window {
 protected:
  std::vector<std::string> more() const override { return {"--renderer", "opengl"}; }
  void SetUp() override {
    setenv("LD_PRELOAD", STUDIO_LOST_CARD, 1);
    Window::SetUp();
    unsetenv("LD_PRELOAD");
  }
  // Resets it, and moves; what the studio says of it.
  Json reset() {
    studio_->send(SIGUSR1);
    key("Left");
    const Json said = studio_->wait_for("recovered");
    finish();
    xdotool("search --sync --onlyvisible --name 'Brain Forest' windowfocus");
    return said;
  }
};

TEST_F(Window, ClickSelectsWhatBruteForceFinds) {
  Random random(11);
  for (int i = 0; i < 6; ++i) {
    const Target target = clear_target(random, view_, viewport(), true);
    const Json facts = click(target.pixel);
    ASSERT_FALSE(facts.is_null());
    EXPECT_EQ(facts.at("neuron"), target.pick->instance);
    const bool soma = target.pick->section == scene::soma_section;
    EXPECT_EQ(facts.at("section"), soma ? Json("soma") : Json(target.pick->section));
  }
  EXPECT_TRUE(click(clear_target(random, view_, viewport(), false).pixel).is_null());
}

TEST_F(Window, SelectionIsLitInThePictureAndEscapePutsItOut) {
  Random random(12);
  const Target target = clear_target(random, view_, viewport(), true);
  const io::Picture before = saved("before.png");
  click(target.pixel);
  finish();
  const io::Picture lit = saved("lit.png");
  const auto at = [&](const io::Picture& p) {
    const std::size_t i = 4 * (std::size_t(target.pixel.y()) * p.width + std::size_t(target.pixel.x()));
    return std::array<int, 3>{p.pixels[i], p.pixels[i + 1], p.pixels[i + 2]};
  };
  EXPECT_NE(at(before), at(lit));
  EXPECT_GT(at(lit)[0], at(lit)[2]);  // the picked section is red
  EXPECT_GT(difference(before, lit), .02);
  key("Escape");
  EXPECT_TRUE(studio_->wait_for("selected").at("facts").is_null());
  finish();
  EXPECT_EQ(saved("after.png").pixels, before.pixels);
}

TEST_F(Window, DragOrbitsAboutTheTarget) {
  const io::Picture before = saved("orbit_before.png");
  const scene::View old = view_;
  drag(1, {300, 300}, {420, 260});
  EXPECT_EQ(view_.camera.target, old.camera.target);
  const float distance = (old.camera.eye - old.camera.target).norm();
  EXPECT_NEAR((view_.camera.eye - view_.camera.target).norm(), distance, 1e-3f * distance);
  EXPECT_GT((view_.camera.eye - old.camera.eye).norm(), .2f * distance);
  EXPECT_GT(difference(before, saved("orbit_after.png")), .1);
}

TEST_F(Window, SavedPictureIsThatOfTheViewDrawnWithoutAWindow) {
  drag(1, {300, 300}, {380, 330});
  key("o");  // no outline
  settle();
  const io::Picture seen = saved("window.png");
  EXPECT_LT(difference(seen, without_a_window(view_, seen.width, seen.height)), .001);
}

TEST_F(Window, WheelComesNearerToWhatIsUnderTheMouse) {
  Random random(17);
  const Vec2 empty = clear_target(random, view_, viewport(), false).pixel;
  scene::View old = view_;
  point(empty);
  xdotool("click 4");
  settle();
  const float before = (old.camera.eye - old.camera.target).norm(),
              after = (view_.camera.eye - view_.camera.target).norm();
  EXPECT_LT(after, .95f * before);
  const auto at_target_depth = [&](const frame::Camera& camera) -> Vec3 {
    const Ray ray = ray_through(camera, viewport(), empty);
    const Vec3 forward = (camera.target - camera.eye).normalized();
    return camera.eye + ray.direction * ((camera.target - camera.eye).norm() / ray.direction.dot(forward));
  };
  EXPECT_LT((at_target_depth(old.camera) - at_target_depth(view_.camera)).norm(), 1.f);
  // Towards a branch, steps are shares of the distance to it: it is reached, not passed.
  key("Home");
  for (frame::Camera last; view_.camera != last;) last = view_.camera, settle();  // the glide there
  old = view_;
  const Target target = clear_target(random, view_, viewport(), true);
  point(target.pixel);
  xdotool("click --repeat 12 --delay 20 4");
  settle();
  const RoundCone branch = scene::in_world(sample(), target.pick->instance, target.pick->segment);
  const auto distance = [&](const frame::Camera& camera) { return (branch.a - camera.eye).norm(); };
  EXPECT_NEAR(distance(view_.camera) / distance(old.camera), std::pow(.85f, 12.f), .08f);
  EXPECT_EQ(click(target.pixel).at("neuron"), target.pick->instance);
}

TEST_F(Window, RightDragAndShiftDragMoveAcross) {
  for (const auto& [button, with] : {std::pair(3, ""), std::pair(1, "shift")}) {
    const scene::View old = view_;
    drag(button, {300, 300}, {360, 300}, with);
    const Vec3 moved = project(view_.camera, viewport(), old.camera.target);
    EXPECT_NEAR(moved.x(), .5f * viewport().width + 60.f, 1.f);
    EXPECT_NEAR(moved.y(), .5f * viewport().height, 1.f);
  }
}

TEST_F(Window, KeysFlyAndTurn) {
  point({300, 300});
  const scene::View old = view_;
  const Vec3 forward = (old.camera.target - old.camera.eye).normalized();
  xdotool("keydown w sleep 0.3 keyup w");
  settle();
  EXPECT_GT((view_.camera.eye - old.camera.eye).dot(forward), 5.f);
  const scene::View flown = view_;
  key("e");
  settle();
  EXPECT_GT((view_.camera.eye - flown.camera.eye).dot(flown.camera.axes().col(1)), 1.f);
  const scene::View risen = view_;
  key("Left");
  settle();
  EXPECT_EQ(view_.camera.eye, risen.camera.eye);
  EXPECT_LT((view_.camera.target - risen.camera.target).dot(risen.camera.axes().col(0)), -1.f);
  key("v");  // fly: a drag now turns the eye where it is
  const scene::View turned = view_;
  drag(1, {300, 300}, {340, 300});
  EXPECT_EQ(view_.camera.eye, turned.camera.eye);
  EXPECT_GT((view_.camera.target - turned.camera.target).dot(turned.camera.axes().col(0)), 1.f);
}

TEST_F(Window, CentreGoesToTheSelection) {
  Random random(13);
  const Target target = clear_target(random, view_, viewport(), true);
  click(target.pixel);
  finish();
  key("f");
  finish();
  // All of the subarbor is in sight now, and its middle in the middle.
  for (const std::uint32_t segment : scene::subarbor(sample(), target.pick->instance, target.pick->section)) {
    const Vec3 seen =
        project(view_.camera, viewport(), scene::in_world(sample(), target.pick->instance, segment).a);
    EXPECT_GT(seen.z(), 0.f);
    EXPECT_NEAR(seen.x(), .5f * viewport().width, .55f * viewport().height);
    EXPECT_NEAR(seen.y(), .5f * viewport().height, .55f * viewport().height);
  }
}

TEST_F(Window, ViewIsCopiedAndPasted) {
  key("ctrl+c");
  const scene::View old = view_;
  drag(1, {300, 300}, {420, 260});
  ASSERT_NE(scene::to_json(view_), scene::to_json(old));
  key("ctrl+v");
  settle();
  EXPECT_EQ(scene::to_json(view_), scene::to_json(old));
}

TEST_F(Window, ThePlaneOfIntersectionIsPartOfTheView) {
  EXPECT_FALSE(view_.plane);
  key("k");
  settle();
  ASSERT_TRUE(view_.plane);
  const scene::View with = view_;
  key("ctrl+c");
  key("k");
  settle();
  EXPECT_FALSE(view_.plane);
  key("ctrl+v");
  settle();
  EXPECT_EQ(scene::to_json(view_), scene::to_json(with));
}

TEST_F(Window, APathOfViewsIsFlownToItsEnd) {
  scene::View end = view_;
  end.camera.eye += Vec3(120, 40, -60);
  end.colour_by = scene::ColourBy::layer;
  const auto path = folder / "path.jsonl";
  write_file(path, scene::to_json(view_) + "\n" + scene::to_json(end) + "\n");
  key("ctrl+shift+k");
  xdotool("search --sync --onlyvisible --name 'Path of views' windowfocus");
  xdotool(fmt::format("key ctrl+a type --delay 5 '{}'", path.string()));
  key("Return");
  for (int i = 0; i < 4 && view_.colour_by != end.colour_by; ++i)
    finish();  // the first may be that of the dialog
  EXPECT_EQ(view_.colour_by, end.colour_by);
  EXPECT_LT((view_.camera.eye - end.camera.eye).norm(), 1.f);
}

TEST_F(Window, AtItsEndAPathThatLoopsGoesBackToItsBeginning) {
  scene::View begin = view_, end = view_;
  begin.camera.eye += Vec3(-80, 20, 0);
  end.camera.eye += Vec3(120, 40, -60);
  const auto path = folder / "loop.jsonl";
  write_file(path, scene::to_json(begin) + "\n" + scene::to_json(end) + "\n");
  key("ctrl+l");
  key("ctrl+shift+k");
  xdotool("search --sync --onlyvisible --name 'Path of views' windowfocus");
  xdotool(fmt::format("key ctrl+a type --delay 5 '{}'", path.string()));
  press_until("Return", "Path of views", 0);
  usleep(3'500'000);  // of the path 2.5 s, and as long back: the way back is its last
  xdotool("search --sync --onlyvisible --name 'Brain Forest' windowfocus");
  key("ctrl+l");
  const auto at = [&](const scene::View& there) {
    return (view_.camera.eye - there.camera.eye).norm() < 1.f;
  };
  for (int i = 0; i < 4 && !at(begin) && !at(end); ++i) finish();
  EXPECT_TRUE(at(begin));
}

TEST_F(Window, FullScreenShowsThePictureAloneAndEscapeBringsAllBack) {
  const frame::Viewport before = viewport();
  Random random(18);
  const Json facts = click(clear_target(random, view_, viewport(), true).pixel);
  finish();
  for (const char* back : {"Escape", "F11"}) {
    key("F11");
    while (viewport().width < 1280.f || viewport().height < 800.f) finish();
    EXPECT_EQ(picture_.at("x"), 0);
    EXPECT_EQ(picture_.at("y"), 0);
    key("b");  // keys work without the menus
    const scene::Background old = view_.background;
    while (view_.background == old) finish();
    key(back);
    while (viewport().width > before.width) finish();
    EXPECT_EQ(viewport().width, before.width);
    EXPECT_EQ(viewport().height, before.height);
  }
  key("p");  // the selection is still there, and so it has a parent
  EXPECT_EQ(studio_->wait_for("selected").at("facts").at("neuron"), facts.at("neuron"));
}

TEST_F(Window, OneTargetIsShownAloneAndThenAllAgain) {
  key("alt+t");
  key("ctrl+Return");
  settle();
  ASSERT_EQ(view_.targets.size(), 2u);
  EXPECT_EQ(view_.targets[0].name, "all");
  EXPECT_EQ(view_.targets[0].visible, false);
  EXPECT_EQ(view_.targets[1].name, "first");
  EXPECT_EQ(view_.targets[1].visible, true);
  key("alt+t");
  key("ctrl+shift+Return");
  settle();
  EXPECT_TRUE(view_.targets.empty());
}

TEST_F(Window, PanelsThatHaveNothingToShowStayHidden) {
  // Left by a session with a plane and its section.
  const frame::Viewport before = viewport();
  key("k");
  settle();
  EXPECT_LT(viewport().width, before.width);
  key("ctrl+q");
  EXPECT_EQ(studio_->end().second, 0);
  studio_ =
      std::make_unique<Studio>(std::vector<std::string>{sample_file(), "--size", "1280x800", "--report"});
  finish();
  EXPECT_EQ(viewport().width, before.width);
  EXPECT_EQ(viewport().height, before.height);
}

TEST_F(Window, ControlsHaveKeys) {
  key("b");
  settle();
  EXPECT_EQ(view_.background, scene::Background::light);
  key("c");
  settle();
  EXPECT_EQ(view_.colour_by, scene::ColourBy::layer);
  key("g");
  settle();
  EXPECT_TRUE(view_.detail.gaze.has_value());
  key("alt+x");
  xdotool("type 123");
  key("Return");
  settle();
  EXPECT_NEAR(view_.camera.eye.x(), 123.f, .1f);
  const io::Picture light = saved("light.png");
  EXPECT_GT(light.pixels[0], 200);
}

TEST_F(Window, TargetsAreShownAndHiddenByKeys) {
  const io::Picture before = saved("targets_before.png");
  // The list begins with the types: the first is hidden by Space on its row, and comes back.
  key("alt+t");
  key("space");
  settle();
  ASSERT_EQ(view_.targets.size(), 1u);
  EXPECT_EQ(view_.targets[0].name, "first");
  EXPECT_EQ(view_.targets[0].visible, false);
  EXPECT_GT(difference(before, saved("targets_hidden.png")), .02);
  key("alt+t");
  key("space");
  settle();
  EXPECT_EQ(view_.targets[0].visible, true);
  EXPECT_LT(difference(before, saved("targets_again.png")), .001);
  // Its opacity, its kind, its colour.
  key("alt+q");
  xdotool("key ctrl+a type 20");
  key("Return");
  settle();
  EXPECT_EQ(view_.targets.back().opacity, .2f);
  const io::Picture clear = saved("targets_clear.png");
  EXPECT_GT(difference(before, clear), .02);
  key("alt+k");
  xdotool("type Somata");
  settle();
  EXPECT_EQ(view_.targets.back().kind, frame::Kind::somata);
  key("alt+c");
  key("Down");
  settle();
  EXPECT_EQ(view_.targets.back().colour, 0xE69F00u);
  EXPECT_GT(difference(clear, saved("targets_somata.png")), .02);
}

TEST_F(Window, AnExpressionBecomesATarget) {
  key("alt+n");
  xdotool("type --delay 5 'first and not upper'");
  key("Return");
  settle();
  ASSERT_EQ(view_.targets.size(), 1u);
  EXPECT_EQ(view_.targets[0].name, "first and not upper");
  EXPECT_EQ(view_.targets[0].visible, true);
  // It is chosen, so that what is said next is meant of it.
  key("alt+c");
  key("Down");
  settle();
  ASSERT_EQ(view_.targets.size(), 1u);
  EXPECT_EQ(view_.targets[0].colour, 0xE69F00u);
  key("alt+n");
  xdotool("type --delay 5 'nobody of this name'");
  key("Return");
  settle();
  EXPECT_EQ(view_.targets.size(), 1u);  // the panel says why
}

TEST_F(Window, WhatIsHiddenCannotBePicked) {
  key("alt+t");
  key("End");  // all
  key("space");
  settle();
  ASSERT_EQ(view_.targets.size(), 1u);
  EXPECT_EQ(view_.targets[0].name, "all");
  Random random(14);
  const Target target = clear_target(random, view_, viewport(), true);
  EXPECT_TRUE(click(target.pixel).is_null());
}

TEST_F(Window, GazeFollowsTheMouse) {
  key("m");
  settle();
  point({100, 250});
  settle();
  ASSERT_TRUE(view_.detail.gaze);
  EXPECT_NEAR(view_.detail.gaze->x() * viewport().width, 100.f, 1.f);
  EXPECT_NEAR(view_.detail.gaze->y() * viewport().height, 250.f, 1.f);
}

TEST_F(Window, WhatSavingWouldReplaceIsAskedOfUnderItsTrueName) {
  const auto path = folder / "asked.png";
  write_file(path, "a person's own");
  key("ctrl+s");
  xdotool("search --sync --onlyvisible --name 'Save picture' windowfocus");
  xdotool(fmt::format("key ctrl+a type --delay 5 '{}'", (folder / "asked").string()));
  press_until("Return", "Save picture", 2);  // the question has the title of the dialog
  EXPECT_EQ(MappedFile(path).text(), "a person's own");
  press_until("Return", "Save picture", 1);  // no, unless one says yes; then the dialog is there again
  EXPECT_EQ(MappedFile(path).text(), "a person's own");
  EXPECT_FALSE(std::filesystem::exists(folder / "asked"));
}

TEST_F(Window, NoFieldOfThePanelsIsCutOff) { EXPECT_EQ(cut_off_, Json::array()); }

TEST_F(Window, KeysAndMouseAreExplainedOnTheScreen) {
  key("F1");
  const auto list = folder / "keys.txt";
  xdotool("search --sync --onlyvisible --name 'Keys and mouse' getwindowgeometry --shell >" + list.string());
  int x = -1, y = -1, width = 0, height = 0;
  const std::string said(MappedFile(list).text());
  ASSERT_EQ(std::sscanf(said.c_str(), "WINDOW=%*d X=%d Y=%d WIDTH=%d HEIGHT=%d", &x, &y, &width, &height), 4)
      << said;
  EXPECT_GE(x, 0);
  EXPECT_GE(y, 0);
  EXPECT_GT(height, 300);
  EXPECT_LE(x + width, 1280);
  EXPECT_LE(y + height, 800);  // the button at its lower end can be clicked
  // Every command has its name beside its key.
  std::map<std::string, std::string> names;
  const Json explained = studio_->wait_for("explained");
  for (const Json& row : explained.at("keys")) names.emplace(row.at("key"), row.at("name"));
  EXPECT_EQ(names.at("U"), "Surfaces");
  EXPECT_EQ(names.at("L"), "Legend");
  EXPECT_EQ(names.at("Ctrl+S"), "Save picture");
  EXPECT_EQ(names.at("Ctrl+1"), "Selection");
  EXPECT_EQ(std::ranges::count(names, "", &std::pair<const std::string, std::string>::second), 7)
      << "gestures alone say what they do without a name";
}

TEST_F(OnACard, ThatIsLostTheForestIsLoadedAnewAndThenDrawnByTheProcessor) {
  const Json first = reset();
  EXPECT_NE(first.at("renderer").get<std::string>().find("card was lost"), std::string::npos) << first;
  EXPECT_NE(first.at("why").get<std::string>().find("was reset by its driver"), std::string::npos) << first;
  const io::Picture again = saved("card_again.png");
  // The hand is answered as before, in the window that was made anew.
  const scene::View old = view_;
  key("Home");
  settle();
  key("ctrl+1");
  key("ctrl+1");
  drag(1, {100, 150}, {160, 160});
  EXPECT_NE(view_.camera.eye, old.camera.eye);
  const Json second = reset();
  EXPECT_NE(second.at("why").get<std::string>().find("The processor draws"), std::string::npos) << second;
  EXPECT_NE(second.at("renderer"), first.at("renderer"));
  const io::Picture by_processor = saved("card_processor.png");
  // Both show the forest: neither is black, nor one colour.
  for (const io::Picture& picture : {again, by_processor}) {
    std::set<std::uint8_t> reds;
    for (std::size_t i = 0; i < picture.pixels.size(); i += 4) reds.insert(picture.pixels[i]);
    EXPECT_GT(reds.size(), 40u);
  }
}

TEST_F(Near, ACopiedViewKeepsItsSkin) {
  key("n");
  settle();
  const std::size_t with = skin_;
  EXPECT_GT(with, 100u);
  key("ctrl+c");
  key("n");
  settle();
  EXPECT_EQ(skin_, 0u);
  key("ctrl+v");
  settle();
  EXPECT_GT(skin_, 100u);
}

TEST_F(Near, SkinIsMadeWhenAskedForAndWhenATargetIsForcedToHaveOne) {
  EXPECT_EQ(skin_, 0u);
  key("n");
  settle();
  EXPECT_GT(skin_, 100u);
  const std::size_t all = skin_;
  key("n");
  settle();
  EXPECT_EQ(skin_, 0u);
  key("alt+t");
  key("End");  // "all"
  key("alt+k");
  key("End");
  key("Up");  // Skin
  settle();
  ASSERT_FALSE(view_.targets.empty());
  EXPECT_EQ(view_.targets.back().kind, frame::Kind::skin);
  EXPECT_GT(skin_, all / 2);  // of half the width, too, as far as the limit goes
}

}  // namespace
}  // namespace forest::studio
