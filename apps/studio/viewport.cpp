// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/viewport.h"

#include <QKeyEvent>
#include <QMouseEvent>
#include <QOpenGLFunctions>
#include <QOpenGLPaintDevice>
#include <QPainter>
#include <cmath>

#include "forest/core/error.h"
#include "forest/frame/soften.h"
#include "forest/scene/colour_bar.h"
#include "forest/scene/gauge.h"
#include "forest/scene/slice_picture.h"

#include "apps/studio/annotation.h"
#include "apps/studio/camera_control.h"

namespace forest::studio {
namespace {

constexpr int rest_milliseconds = 200;                    // a view that stands still so long is drawn in full
constexpr float slice_milliseconds = 60.f;                // of refining between two looks at the mouse
constexpr float glide_seconds = .7f, key_seconds = 2.5f;  // of a glide; between views of a path
constexpr float tap_seconds = .05f;              // of flight that a tap on a key makes, however short
constexpr float turn_pixels_a_second = 400.f;    // of the arrow keys
constexpr std::size_t moving_synapses = 60'000;  // drawn at most while the view moves
constexpr std::size_t still_pieces = 24;         // of skin, made between two looks at the mouse
constexpr float reach = 3.f;                     // a click so many pixels beside a branch means it
constexpr float through = .3f;    // what nothing shall hide is drawn at this share of its distance
constexpr float rim = 1.8f;       // points of a mark beside the branch that it is around
constexpr qint64 one_turn = 500;  // milliseconds between steps of the wheel that are one movement

struct FlightKey {
  int key;
  Vec3 way;   // right, up, forward
  Vec2 turn;  // right, down
};
const FlightKey flight_keys[] = {
    {Qt::Key_W, {0, 0, 1}, {0, 0}},     {Qt::Key_S, {0, 0, -1}, {0, 0}},    {Qt::Key_A, {-1, 0, 0}, {0, 0}},
    {Qt::Key_D, {1, 0, 0}, {0, 0}},     {Qt::Key_Q, {0, -1, 0}, {0, 0}},    {Qt::Key_E, {0, 1, 0}, {0, 0}},
    {Qt::Key_Left, {0, 0, 0}, {-1, 0}}, {Qt::Key_Right, {0, 0, 0}, {1, 0}}, {Qt::Key_Up, {0, 0, 0}, {0, -1}},
    {Qt::Key_Down, {0, 0, 0}, {0, 1}},
};
bool is_flight_key(int key) {
  return std::ranges::any_of(flight_keys, [key](const FlightKey& k) { return k.key == key; });
}

float depth_of(const frame::Overlay& mark, const frame::Camera& camera) {
  return std::max(0.f, (.5f * (mark.a + mark.b) - camera.eye).dot(-camera.axes().col(2)));
}

// As large in the picture, at a share of its distance.
void move_along_sight(frame::Overlay& mark, const frame::Camera& camera, float share) {
  if (camera.orthographic()) {
    const Vec3 way = (share - 1.f) * depth_of(mark, camera) * -camera.axes().col(2);
    mark.a += way, mark.b += way;
    return;
  }
  mark.a = camera.eye + share * (mark.a - camera.eye), mark.b = camera.eye + share * (mark.b - camera.eye);
  mark.radius *= share;
}

// Nearer than all tissue, and not so near that it is cut.
float share_in_front(float depth, const frame::Camera& camera) {
  return std::min(1.f, std::max(through, 1.05f * camera.near / std::max(depth, 1e-3f)));
}

// Marks that can be seen however far they are: no thinner than a few pixels, a section wider than its subarbor.
std::vector<frame::Overlay> visible(std::vector<frame::Overlay> marks, const frame::Camera& camera,
                                    float height) {
  for (frame::Overlay& mark : marks)
    mark.radius = std::max(mark.radius, (mark.colour == scene::section_entry ? 1.9f : 1.3f) *
                                            camera.pixel_size(height, depth_of(mark, camera)));
  return marks;
}

// A rim around the picked section, which leaves the colours of its values alone: marks that are wider, and lie behind it.
// @param front  the section itself is drawn before all tissue
std::vector<frame::Overlay> rims(const std::vector<frame::Overlay>& marks, const frame::Camera& camera,
                                 float height, float ratio, bool front) {
  std::vector<frame::Overlay> all;
  for (frame::Overlay mark : marks) {
    const float depth = depth_of(mark, camera);
    if (mark.colour != scene::section_entry || depth < camera.near) continue;
    const float pixel = camera.pixel_size(height, depth);
    mark.radius = std::max(mark.radius, pixel) + rim * ratio * pixel;
    move_along_sight(mark, camera,
                     (front ? share_in_front(depth, camera) : 1.f) * (1.f + 2.5f * mark.radius / depth));
    all.push_back(mark);
  }
  return all;
}

Vec2 vec(const QPointF& p) { return {float(p.x()), float(p.y())}; }

}  // namespace

Viewport::Viewport(scene::Forest forest, const scene::View& view, circuit::NodeSets sets, Drawer drawer,
                   QWidget* parent)
    : QOpenGLWidget(parent),
      forest_(std::move(forest)),
      targets_(forest_, std::move(sets)),
      chooser_(forest_),
      settings_{.view = view},
      colouring_(scene::colour(targets_, view)),
      outline_(scene::outline(forest_)),
      pia_(scene::towards_pia(forest_)),
      has_axons_(std::ranges::any_of(
          forest_.sections(), [](std::uint32_t kind) { return SectionKind(kind) == SectionKind::axon; },
          &scene::SectionFacts::kind)),
      dressing_(forest_),
      drawer_(drawer) {
  set_view(settings_, view, forest_.soma_bounds().centre());
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(true);
  setMinimumSize(240, 160);
  setAccessibleName(tr("The forest"));
  setAccessibleDescription(tr("Drag to orbit, click a branch to select it, wheel to come nearer"));
  rest_.setSingleShot(true);
  rest_.setInterval(rest_milliseconds);
  connect(&rest_, &QTimer::timeout, this, [this] {
    stage_ = Stage::refining;
    refined_ = 0;
    update();
  });
}

Viewport::~Viewport() {
  if (context()) disconnect(context(), nullptr, this, nullptr);
  release();
}

scene::View Viewport::view() const { return whole_view(settings_, forest_.soma_bounds().centre()); }

std::string Viewport::text() const { return text_of(settings_, forest_.soma_bounds().centre()); }

void Viewport::change(const Settings& settings) {
  const scene::View& old = settings_.view;
  const bool recolour = settings.view.colour_by != old.colour_by ||
                        settings.view.background != old.background || settings.view.targets != old.targets;
  if (recolour) colouring_ = scene::colour(targets_, settings.view);
  settings_ = settings;
  if (playback_ && settings_.view.activity)
    settings_.view.activity = playback_->fitted(*settings_.view.activity);
  touch();
  Q_EMIT changed();
  if (recolour) Q_EMIT recoloured();
}

void Viewport::set_camera(const frame::Camera& camera) {
  settings_.view.camera = camera;
  touch();
  Q_EMIT changed();
}

void Viewport::touch() {
  moved_.restart();
  draw_anew();
}

void Viewport::draw_anew() {
  stage_ = Stage::moving;
  rest_.start();
  update();
}

void Viewport::glide_to(const frame::Camera& camera) {
  scene::View to = settings_.view;
  to.camera = camera;
  glide_ = Glide{scene::CameraPath({settings_.view, to}), camera, glide_seconds};
  glide_->clock.start();
  touch();
}

void Viewport::fly_along(std::vector<scene::View> views) {
  for (scene::View& view : views) {
    (void)scene::colour(targets_, view);  // or throws
    view.activity = settings_.view.activity;
  }
  const frame::Camera end = views.back().camera;
  const float seconds = key_seconds * float(std::max<std::size_t>(1, views.size() - 1));
  glide_ =
      Glide{.path = scene::CameraPath(views), .end = end, .seconds = seconds, .whole = true, .views = {}};
  glide_->views = std::move(views);
  glide_->clock.start();
  touch();
}

void Viewport::centre() {
  const frame::Camera& camera = settings_.view.camera;
  if (selection_) return glide_to(centred_on(camera, around(forest_, *selection_)));
  frame::Camera all = whole();
  all.field_of_view = camera.field_of_view;
  glide_to(all);
}

frame::Camera Viewport::whole() const {
  const float aspect = float(width()) / float(std::max(1, height()));
  if (forest_.instances().empty() && !dressing_.surfaces.empty())
    return dressing_.surfaces.camera(dressing_.surfaces.outside(), aspect);
  frame::Camera camera = scene::overview(forest_, aspect, colouring_.states).camera;
  camera.near = settings_.view.camera.near;
  return camera;
}

void Viewport::select(const std::optional<scene::Pick>& pick, std::optional<std::uint32_t> synapse) {
  selected_synapse_ = pick ? synapse : std::nullopt;
  selection_ = pick ? std::optional(studio::select(forest_, *pick)) : std::nullopt;
  highlight_ = selection_ ? highlight(forest_, *selection_) : std::vector<frame::Overlay>{};
  draw_anew();
  Q_EMIT selected();
}

std::optional<scene::Pick> Viewport::pick(const QPointF& place) {
  const frame::Camera& camera = settings_.view.camera;
  const Vec2 at = vec(place) + Vec2(.5f, .5f);
  auto exact =
      scene::pick(forest_, camera, in_points(), at, .5f / float(devicePixelRatioF()), colouring_.shown());
  if (figures_.triangles) {
    const auto has_skin = [&](std::uint32_t i) {
      const frame::State& state = colouring_.states[i];
      return state.is(frame::State::visible) &&
             (state.kind == frame::Kind::skin || (state.kind == frame::Kind::any && settings_.skin));
    };
    const auto spine = pick_spine(dressing_.skin, forest_, camera, in_points(), at, has_skin);
    if (spine && (!exact || spine->distance < exact->distance)) exact = spine;
  }
  return exact ? exact : scene::pick(forest_, camera, in_points(), at, reach, colouring_.shown());
}

std::optional<std::pair<std::uint32_t, scene::Pick>> Viewport::pick_synapse(const QPointF& place) const {
  if (!dressing_.synapses) return std::nullopt;
  const Vec2 at = vec(place) + Vec2(.5f, .5f);
  const auto found = scene::pick(dressing_.chosen, settings_.view.camera, in_points(), at, 1.5f);
  if (!found) return std::nullopt;
  const scene::Synapse& synapse = dressing_.synapses->all()[found->synapse];
  const auto branch = scene::pick(forest_, settings_.view.camera, in_points(), at, 0.f, colouring_.shown());
  if (branch && branch->distance < found->distance - double(synapse.radius_um())) return std::nullopt;
  const scene::Neuron& neuron = forest_.neurons()[forest_.instances()[synapse.target].morphology];
  return std::pair(found->synapse, scene::Pick{synapse.target, neuron.first_segment + synapse.segment,
                                               dressing_.synapses->section(synapse), found->distance});
}

void Viewport::show(scene::Synapses synapses) {
  if (selected_synapse_) select(std::nullopt);
  dressing_.chosen = {};
  dressing_.synapses.emplace(std::move(synapses));
  settings_.has_synapses = true;
  touch();
  Q_EMIT changed();
}

void Viewport::show(scene::Surfaces surfaces) {
  dressing_.surfaces = std::move(surfaces);
  settings_.has_surfaces = !dressing_.surfaces.empty();
  touch();
  Q_EMIT changed();
}

void Viewport::play(scene::Playback playback) {
  // What is said of a view that is opened with its simulation is kept, what was said of another simulation is not.
  if (playback_ || !settings_.view.activity) settings_.view.activity = playback.view();
  playback_.emplace(std::move(playback));
  playing_ = false;
  settings_.view.activity = playback_->fitted(*settings_.view.activity);
  set_time(settings_.view.activity->time.value_or(playback_->begin()));
  Q_EMIT opened();
  Q_EMIT changed();
}

void Viewport::put_away_playback(const QString& why) {
  if (!playback_) return;
  playback_.reset();
  playing_ = false;
  settings_.view.activity.reset();
  touch();
  Q_EMIT put_away(why);
  Q_EMIT changed();
}

scene::ActivityView Viewport::activity() const {
  return settings_.view.activity.value_or(playback_ ? playback_->view() : scene::ActivityView());
}

void Viewport::change(const scene::ActivityView& activity) {
  settings_.view.activity = activity;
  draw_anew();
  Q_EMIT changed();
}

double Viewport::time() const { return activity().time.value_or(playback_ ? playback_->begin() : 0.); }

void Viewport::set_time(double milliseconds) {
  if (!playback_) return;
  scene::ActivityView shown = activity();
  shown.time = std::clamp(milliseconds, playback_->begin(), playback_->end());
  settings_.view.activity = shown;
  window_ = 0.;
  draw_anew();
  Q_EMIT moved();
}

void Viewport::set_playing(bool playing) {
  playing_ = playing && playback_;
  tick_.restart();
  window_ = 0.;
  draw_anew();
  Q_EMIT moved();
}

std::uint32_t Viewport::samples_at_rest() const {
  return dressing_.still_samples(settings_.view, colouring_);
}

frame::Image Viewport::picture() {
  if (!renderer_) throw Error("there is no picture yet; wait until one is drawn");
  makeCurrent();
  const std::uint32_t samples = std::max(samples_at_rest(), 16u);
  draw_still(samples, 0, samples);
  frame::Image image = united_ ? *united_ : renderer_->read();
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 255;
  doneCurrent();
  touch();
  return image;
}

QImage Viewport::seen() {
  // Opacity holds the share of a pixel that is covered, not how clear the window is.
  return grabFramebuffer().convertToFormat(QImage::Format_RGBA8888);
}

void Viewport::make_renderer() {
  renderer_.reset();
  card_ = nullptr, processor_ = nullptr, united_ = nullptr;
  if (drawer_ != Drawer::processor) {
    auto card = std::make_unique<render::OpenGLRenderer>();
    if (drawer_ == Drawer::opengl || !card->on_processor()) {
      card->load(forest_.geometry());
      card_ = card.get();
      renderer_ = std::move(card);
    }
  }
  if (!renderer_) {
    auto processor = std::make_unique<render::CpuRenderer>();
    processor->load(forest_.geometry());
    processor_ = processor.get();
    renderer_ = std::move(processor);
  }
  renderer_name_ = QString::fromStdString(renderer_->name());
  if (losses_) renderer_name_ += tr(" (the graphics card was lost)");
  warming_up_ = 2;
}

void Viewport::release() {
  makeCurrent();
  renderer_.reset();
  card_ = nullptr, processor_ = nullptr, united_ = nullptr;
  doneCurrent();
}

// Called once for each context: Qt makes another when the widget goes to another window.
void Viewport::initializeGL() {
  connect(context(), &QOpenGLContext::aboutToBeDestroyed, this, &Viewport::release, Qt::DirectConnection);
  try {
    try {
      make_renderer();
    } catch (const std::exception& error) {
      if (drawer_ == Drawer::processor) throw;
      drawer_ = Drawer::processor;
      make_renderer();
      why_lost_ = QString::fromUtf8(error.what());
    }
    if (!why_lost_.isEmpty())
      Q_EMIT recovered(processor_ ? tr("The processor draws from now on: %1").arg(why_lost_)
                                  : tr("All is loaded anew: %1").arg(why_lost_));
    why_lost_.clear();
    touch();
  } catch (const std::exception& error) {
    renderer_.reset();
    Q_EMIT failed(QString::fromUtf8(error.what()));
  }
}

// The card may come back with another context; one that is lost again is left alone.
void Viewport::recover(const std::string& why) {
  why_lost_ = QString::fromUtf8(why.c_str());
  if (++losses_ > 1) drawer_ = Drawer::processor;
  renderer_.reset();
  card_ = nullptr, processor_ = nullptr, united_ = nullptr;
  Q_EMIT lost();
}

void Viewport::resizeGL(int, int) { touch(); }

void Viewport::advance(float seconds) {
  if (playing_) {
    const double step = double(rate_ * seconds), begin = playback_->begin(),
                 length = playback_->end() - begin, next = time() + step;
    set_time(next <= playback_->end() ? next
             : step < length          ? begin  // and again
                                      : begin + std::fmod(next - begin, std::max(length, step / 1e6)));
    window_ = step;
  }
  if (glide_) glide_on();
  if (!flies()) return;
  Vec3 way = Vec3::Zero();
  Vec2 turn = Vec2::Zero();
  for (const FlightKey& k : flight_keys)
    if (held_.contains(k.key)) way += k.way, turn += k.turn;
  const float speed = settings_.speed * (fast_ ? 4.f : 1.f);
  set_camera(fly(look(settings_.view.camera, turn_pixels_a_second * seconds * turn), speed * seconds * way));
}

void Viewport::glide_on() {
  const float t = float(glide_->clock.elapsed()) / (1000.f * glide_->seconds);
  Settings next = settings_;
  if (glide_->whole)
    set_view(next, glide_->path.at(std::min(t, 1.f)), forest_.soma_bounds().centre()),
        next.view.activity = settings_.view.activity;
  else
    next.view.camera = glide_->path.at(std::min(t, 1.f)).camera;
  if (t < 1.f) return change(next);
  next.view.camera = glide_->end;
  const Glide there = std::move(*glide_);
  glide_.reset();
  change(next);
  if (!loop_ || there.views.empty()) return;
  // A path that ends where it began needs no way back.
  const frame::Camera& first = there.views.front().camera;
  if (there.returns || first == there.end) return fly_along(there.views);
  glide_ = Glide{.path = scene::CameraPath({there.views.back(), there.views.front()}),
                 .end = first,
                 .seconds = key_seconds,
                 .whole = true,
                 .views = there.views,
                 .returns = true};
  glide_->clock.start();
}

std::vector<frame::Overlay> Viewport::in_front(const scene::View& view, const scene::Eye& eye,
                                               const scene::Chooser::Painter& painter) const {
  const std::uint32_t instance = selection_->pick.instance;
  const frame::State& state = colouring_.states[instance];
  constexpr frame::Kind as_branches[] = {frame::Kind::any, frame::Kind::lines, frame::Kind::capsules};
  if (figures_.triangles || state.opacity < 255 || !state.is(frame::State::visible) ||
      state.is(frame::State::parted) || std::ranges::find(as_branches, state.kind) == std::end(as_branches))
    return {};
  const scene::Neuron& neuron = forest_.neurons()[forest_.instances()[instance].morphology];
  scene::Cut branches;  // a segment each
  for (std::uint32_t i = 0; i < neuron.original_count; ++i)
    branches.dots.push_back({.instance = instance,
                             .first_segment = neuron.first_segment + i,
                             .drawn = 1,
                             .state = 0,
                             .x = 0.f,
                             .y = 0.f,
                             .z = 0.f,
                             .radius = 0.f});
  painter(branches, eye);
  if (!branches.entries) return {};
  std::vector<frame::Overlay> marks;
  for (std::uint32_t i = 0; i < neuron.original_count && marks.size() < most_marks; ++i)
    add_marks(scene::in_world(forest_, instance, neuron.first_segment + i), branches.entries->dots[i], marks);
  std::erase_if(marks, [&](frame::Overlay& mark) {
    const float depth = depth_of(mark, view.camera);
    move_along_sight(mark, view.camera, share_in_front(depth, view.camera));
    return depth < view.camera.near;
  });
  return marks;
}

void Viewport::draw_part(const scene::View& of, std::uint32_t first, std::uint32_t last,
                         const DressingLimits& limits) {
  const auto w = std::uint32_t(std::lround(width() * devicePixelRatioF())),
             h = std::uint32_t(std::lround(height() * devicePixelRatioF()));
  if (playback_) playback_->begin_picture();
  scene::Chooser::Painter painter;
  const bool spikes_alone = playback_ && !playback_->has_values(), coloured = playback_ && !spikes_alone;
  scene::View view = of;
  scene::ActivityView& shown = view.activity.emplace(activity());
  if (selection_ && settings_.dim) shown.neuron = selection_->pick.instance;
  if (coloured)
    painter = [this, shown, window = window_](scene::Cut& cut, const scene::Eye& eye) {
      playback_->colour(cut, eye, shown, {.window = window, .states = colouring_.states});
    };
  else if (colouring_.gauge)
    painter = [this](scene::Cut& cut, const scene::Eye&) { scene::paint(forest_, colouring_, cut); };
  const scene::Eye eye(view.camera, {float(w), float(h)}, scene::detail_for(view, w, h));
  std::vector<frame::Overlay> overlays;
  if (selection_ && coloured) {
    // What a branch does is seen within the rim of the picked section, and not under marks.
    if (settings_.dim) overlays = in_front(view, eye, painter);
    const auto around =
        rims(highlight_, view.camera, float(h), float(devicePixelRatioF()), !overlays.empty());
    overlays.insert(overlays.end(), around.begin(), around.end());
  } else {
    overlays = visible(highlight_, view.camera, float(h));
    if (playback_)
      std::erase_if(overlays, [](const frame::Overlay& o) { return o.colour != scene::section_entry; });
  }
  if (first == 0 && !layered(view)) chooser_.choose(eye, colouring_.shown(), painter);
  if (settings_.outline) overlays.insert(overlays.end(), outline_.begin(), outline_.end());
  scene::Colouring colouring = colouring_;
  if (spikes_alone) {
    const auto flashes = playback_->flashes(view.camera, float(h), colouring, shown, {.window = window_});
    overlays.insert(overlays.end(), flashes.begin(), flashes.end());
    make_quiet(colouring.palette, view.background);
  }
  mark_selection(colouring.palette, view.background, selection_ && settings_.dim, coloured);
  std::optional<frame::Glass> glass;
  if (const auto plane = this->view().plane) {
    glass = scene::plane_glass(forest_, *plane, view.background);
    const auto marks = scene::plane_marks(forest_, *plane);
    overlays.insert(overlays.end(), marks.begin(), marks.end());
  }
  dressing_.skinned = settings_.skin;
  dressing_.surfaces.visibility = settings_.surfaces ? settings_.surface_opacity : 0.f;
  dressing_.begin();
  figures_.synapses = figures_.triangles = 0;
  Foveated::Dresser dress;
  if (dressing_.wanted(view, colouring))
    dress = [&](frame::Frame& to, const scene::Cut& cut, const scene::Eye& of_layer) {
      dressing_.put_on(to, view, cut, of_layer, colouring, coloured, painter, limits);
      figures_.synapses = dressing_.chosen.balls.size(), figures_.triangles = dressing_.skins.triangles;
    };
  if (layered(view)) {
    if (!foveated_) foveated_.emplace(forest_, [] { return std::make_unique<render::CpuRenderer>(); });
    united_ = &foveated_->draw(view, w, h, colouring, overlays, glass, first, last, painter, dress);
    figures_.segments = foveated_->figures().segments, figures_.neurons = foveated_->figures().neurons;
    figures_.samples = last, figures_.error = view.detail.error * view.detail.pixel;
    return;
  }
  united_ = nullptr;
  frame::Frame frame = scene::compose(forest_, view, colouring, chooser_.cut(), w, h, overlays);
  frame.glass = glass;
  chooser_.complete(frame);
  if (dress) dress(frame, chooser_.cut(), eye);
  frame.first_subframe = first, frame.last_subframe = last;
  renderer_->draw(frame);
  chooser_.remember(renderer_->seen(), renderer_->reached());
  figures_.segments = chooser_.segments(), figures_.neurons = chooser_.neurons();
  figures_.samples = last, figures_.error = view.detail.error;
}

bool Viewport::layered(const scene::View& view) const { return processor_ && scene::layered(view); }

scene::Budget& Viewport::budget() {
  if (moved_.hasExpired(rest_milliseconds)) return standing_budget_;
  return processor_ && settings_.view.detail.gaze ? gaze_budget_ : budget_;
}

void Viewport::draw_moving(const scene::Budget& budget) {
  const scene::View view = scene::within(settings_.view, budget);
  // What is not there yet is made once the view stands still.
  draw_part(view, 0, view.samples, {.skin = {.new_pieces = 0}, .synapses = moving_synapses});
}

void Viewport::draw_still(std::uint32_t samples, std::uint32_t first, std::uint32_t last,
                          const DressingLimits& limits) {
  scene::View view = settings_.view;
  view.samples = samples;
  draw_part(view, first, last, limits);
}

void Viewport::refine() {
  QElapsedTimer clock;
  clock.start();
  const std::uint32_t samples = samples_at_rest();
  const std::uint32_t group = processor_ ? frame::drawn_together(samples) : 1;
  const auto affordable =
      std::uint32_t(std::max(1.f, slice_milliseconds / sample_milliseconds_ / float(group)));
  const std::uint32_t until = std::min(samples, (refined_ / group + affordable) * group);
  draw_still(samples, refined_, until, {.skin = {.new_pieces = still_pieces}});
  sample_milliseconds_ = std::max(.5f, float(clock.nsecsElapsed()) * 1e-6f / float(until - refined_));
  refined_ = dressing_.skins.missing ? 0 : until;  // more of it is there the next time
  if (refined_ == samples) stage_ = Stage::finished;
}

void Viewport::took(float milliseconds, scene::Budget& budget) {
  budget.took(double(milliseconds), figures_.segments);
  milliseconds_ = milliseconds_ > 0.f ? .8f * milliseconds_ + .2f * milliseconds : milliseconds;
  figures_.frames_per_second = 1000.f / milliseconds_;
}

void Viewport::paintGL() {
  if (!renderer_) return;
  advance(std::min(.1f, tick_.isValid() ? 1e-3f * float(tick_.restart()) : 0.f));
  if (!tick_.isValid()) tick_.start();
  const Stage stage = stage_;
  try {
    QElapsedTimer clock;
    clock.start();
    scene::Budget& budget = this->budget();
    const float softness = budget.softness();  // of what is drawn now
    if (stage == Stage::moving) draw_moving(budget);
    if (stage == Stage::refining) refine();
    QOpenGLFunctions* gl = context()->functions();
    gl->glDisable(GL_SCISSOR_TEST);
    if (card_) card_->show(defaultFramebufferObject());
    if (processor_) paint(united_ ? *united_ : *processor_->image(), stage == Stage::moving ? softness : 0.f);
    // The renderer's opacity says how much of a pixel is covered; the window itself is opaque.
    gl->glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_TRUE);
    gl->glClearColor(0, 0, 0, 1);
    gl->glClear(GL_COLOR_BUFFER_BIT);
    gl->glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    annotate();
    if (stage == Stage::moving && --warming_up_ < 0) took(float(clock.nsecsElapsed()) * 1e-6f, budget);
  } catch (const std::exception& error) {
    // All that is drawn was checked when it was opened, but for values of a simulation, which are as they are read.
    if (playback_ && dynamic_cast<const InputError*>(&error))
      return put_away_playback(QString::fromUtf8(error.what()));
    if (card_) return recover(error.what());
    renderer_.reset();
    Q_EMIT failed(QString::fromUtf8(error.what()));
    return;
  }
  Q_EMIT drawn();
  if (glide_ || flies() || playing_ || stage_ == Stage::refining) update();
  if (stage == Stage::refining && stage_ == Stage::finished) Q_EMIT settled();
}

void Viewport::paint(const frame::Image& drawn, float softness) {
  if (drawn.pixels.empty()) return;
  if (softness > 0.f) frame::soften(drawn, softness, softened_);
  const frame::Image& image = softness > 0.f ? softened_ : drawn;
  QOpenGLPaintDevice device(size() * devicePixelRatioF());
  QPainter painter(&device);
  painter.drawImage(
      0, 0, QImage(image.pixels.data(), int(image.width), int(image.height), QImage::Format_RGBX8888));
}

std::vector<scene::LegendEntry> Viewport::legend() const {
  std::vector<scene::LegendEntry> entries = colouring_.legend;
  // By type an axon has the colour of its neuron, but cooler and dimmer: so it is told, of the first few.
  scene::LegendEntry axons{"axons: dimmer and cooler", {}};
  constexpr std::size_t few = 4;
  const frame::Palette& palette = colouring_.palette;
  for (std::size_t i = 0; i < std::min(entries.size(), few) && !entries[i].colours.empty(); ++i)
    for (std::uint32_t c = 0; c < scene::colour_classes; ++c)
      if (palette[8 * c + std::uint32_t(SectionKind::apical)] == entries[i].colours.front()) {
        axons.colours.push_back(palette[8 * c + std::uint32_t(SectionKind::axon)]);
        break;
      }
  if (has_axons_ && settings_.view.colour_by == scene::ColourBy::type && !axons.colours.empty())
    entries.push_back(axons);
  if (figures_.synapses && settings_.view.synapses == scene::SynapseColour::sign)
    std::ranges::move(scene::synapse_legend(settings_.view.background), std::back_inserter(entries));
  if (figures_.synapses && settings_.view.synapses == scene::SynapseColour::target)
    entries.push_back({"synapses: as the neuron that they are on", {}});
  return entries;
}

void Viewport::annotate() {
  QOpenGLPaintDevice device(size() * devicePixelRatioF());
  device.setDevicePixelRatio(devicePixelRatioF());
  QPainter painter(&device);
  painter.setFont(font());
  painter.setRenderHint(QPainter::Antialiasing);
  const Ink ink = ink_on(settings_.view.background);
  if (settings_.scale) {
    const QRectF taken = paint_scale(painter, rect(), settings_.view.camera, ink);
    paint_directions(painter, rect(), settings_.view.camera, ink, pia_, taken);
  }
  if (settings_.legend) {
    Explanations explanations(painter, rect(), ink);
    if (playback_) explanations.add(scene::bar_of(*playback_, activity(), settings_.view.background));
    if (const auto bar = scene::bar_of(colouring_, settings_.view.background); bar && !playback_)
      explanations.add(*bar);
    if (const auto bar = scene::bar_of(dressing_.surfaces); bar && dressing_.surfaces.visibility > 0.f)
      explanations.add(*bar);
    if (!playback_) explanations.add(legend());
  }
  if (const auto& gaze = settings_.view.detail.gaze)
    paint_gaze(painter, QPointF(gaze->x() * float(width()), gaze->y() * float(height())), ink);
}

void Viewport::mousePressEvent(QMouseEvent* event) {
  pressed_ = mouse_ = event->position();
  dragged_ = false;
  glide_.reset();
}

void Viewport::mouseMoveEvent(QMouseEvent* event) {
  const Vec2 moved = vec(event->position() - mouse_);
  mouse_ = event->position();
  if (settings_.gaze_follows && settings_.view.detail.gaze) {
    Settings s = settings_;
    const Vec2 share = vec(mouse_).array() / Vec2(float(width()), float(height())).array();
    s.view.detail.gaze = share.cwiseMax(0.f).cwiseMin(1.f);  // a drag goes on outside
    change(s);
  }
  if (!event->buttons()) return;
  if (!dragged_ && (mouse_ - pressed_).manhattanLength() < 4) return;
  const Vec2 drag = dragged_ ? moved : vec(mouse_ - pressed_);
  dragged_ = true;
  const frame::Camera& camera = settings_.view.camera;
  const bool left = event->buttons() & Qt::LeftButton;
  if (!left || event->modifiers() & Qt::ShiftModifier)
    set_camera(pan(camera, in_points(), drag));
  else
    set_camera(settings_.fly ? look(camera, drag) : orbit(camera, drag));
}

void Viewport::mouseReleaseEvent(QMouseEvent* event) {
  if (!dragged_ && event->button() == Qt::LeftButton) {
    if (const auto synapse = pick_synapse(event->position()))
      select(synapse->second, synapse->first);
    else
      select(pick(event->position()));
  }
  dragged_ = event->buttons() ? dragged_ : false;
}

void Viewport::mouseDoubleClickEvent(QMouseEvent* event) {
  dragged_ = true;  // its release selects nothing
  select(pick(event->position()));
  if (selection_) centre();
}

void Viewport::wheelEvent(QWheelEvent* event) {
  const float steps = float(event->angleDelta().y()) / 120.f;
  glide_.reset();
  frame::Camera camera = settings_.view.camera;
  Vec2 pixel = vec(event->position());
  if (const auto goal = goal_under(event->position())) {
    const Vec3 seen = project(camera, in_points(), *goal);
    pixel = seen.head<2>(), camera = focused(camera, seen.z());
  }
  set_camera(dolly(camera, in_points(), pixel, std::pow(.85f, steps)));
  event->accept();
}

// Step after step towards the same thing: it stays under the mouse however thin it is, and whatever else comes in sight.
std::optional<Vec3> Viewport::goal_under(const QPointF& place) {
  const frame::Camera& camera = settings_.view.camera;
  const auto depth = [&](const Vec3& p) { return (p - camera.eye).dot(-camera.axes().col(2)); };
  if (approach_ && approach_->place == place && approach_->clock.elapsed() < one_turn &&
      depth(approach_->goal) > 4.f * shortest) {
    approach_->clock.start();
    return approach_->goal;
  }
  approach_.reset();
  const auto found = pick(place);
  if (!found) return std::nullopt;
  const Ray ray = ray_through(camera, in_points(), vec(place) + Vec2(.5f, .5f));
  Vec3 goal = ray.origin + float(found->distance) * ray.direction;
  // A branch that the mouse misses by a little would be missed by more and more.
  const RoundCone branch = scene::in_world(forest_, found->instance, found->segment);
  const Vec3 way = branch.b - branch.a, across = way - way.dot(ray.direction) * ray.direction,
             from = ray.origin - branch.a;
  const float along =
      across.squaredNorm() > 0.f ? std::clamp(from.dot(across) / across.squaredNorm(), 0.f, 1.f) : 0.f;
  const Vec3 axis = branch.a + along * way;
  const float off = (axis - ray.origin).cross(ray.direction).norm(),
              radius = branch.radius_a + along * (branch.radius_b - branch.radius_a);
  if (off > radius && off < radius + reach * camera.pixel_size(float(height()), depth(axis))) goal = axis;
  if (!(depth(goal) > 0.f)) return std::nullopt;
  approach_ = Approach{place, goal};
  approach_->clock.start();
  return goal;
}

void Viewport::keyPressEvent(QKeyEvent* event) {
  fast_ = event->modifiers() & Qt::ShiftModifier;
  if (!is_flight_key(event->key())) return QOpenGLWidget::keyPressEvent(event);
  if (event->isAutoRepeat()) return;
  glide_.reset();
  const std::set<int> others = std::exchange(held_, {event->key()});
  advance(tap_seconds);
  held_.insert(others.begin(), others.end());
  tick_.restart();
}

void Viewport::keyReleaseEvent(QKeyEvent* event) {
  fast_ = event->modifiers() & Qt::ShiftModifier;
  if (!event->isAutoRepeat()) held_.erase(event->key());
  QOpenGLWidget::keyReleaseEvent(event);
}

void Viewport::focusOutEvent(QFocusEvent* event) {
  held_.clear();
  QOpenGLWidget::focusOutEvent(event);
}

}  // namespace forest::studio
