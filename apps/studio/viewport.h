// SPDX-License-Identifier: Apache-2.0
// The picture in the window: it draws the forest, takes the mouse and the keys, and picks.
// A view that moves is drawn with one sample a pixel and as much detail as its time allows; once it has stood still for
// a moment it is drawn again in full, a few samples at a time so that nobody waits for it.
#pragma once

#include <QElapsedTimer>
#include <QOpenGLWidget>
#include <QTimer>
#include <memory>
#include <optional>
#include <set>

#include "forest/render/cpu/cpu_renderer.h"
#include "forest/render/opengl/opengl_renderer.h"
#include "forest/scene/chooser.h"
#include "forest/scene/path.h"
#include "forest/scene/playback.h"

#include "apps/drawer.h"
#include "apps/dressing.h"
#include "apps/foveated.h"
#include "apps/studio/selection.h"
#include "apps/studio/settings.h"

namespace forest::studio {

class Viewport final : public QOpenGLWidget {
  Q_OBJECT

 public:
  /// @param sets  names that targets may use
  Viewport(scene::Forest forest, const scene::View& view, circuit::NodeSets sets,
           Drawer drawer = Drawer::automatic, QWidget* parent = nullptr);
  ~Viewport() override;

  const scene::Forest& forest() const { return forest_; }
  const scene::Targets& targets() const { return targets_; }
  const scene::Colouring& colouring() const { return colouring_; }
  const Settings& settings() const { return settings_; }
  scene::View view() const;  // as text has it
  std::string text() const;  // that text
  /// Throws Error, and changes nothing, for a target that is not there.
  void change(const Settings& settings);
  /// Glides there, slow in and slow out.
  void glide_to(const frame::Camera& camera);
  /// Through recorded views, as a film of them goes; a hand on the picture ends it. The simulation goes on by itself. Throws
  /// Error, and stays, for a target that is not there.
  void fly_along(std::vector<scene::View> views);
  /// From the end of a path back to its beginning, and along it again, until a hand ends it.
  void set_loop(bool loop) { loop_ = loop; }
  /// Glides to where the selected subarbor, or without one the whole forest, fills the picture.
  void centre();

  const std::optional<Selection>& selection() const { return selection_; }
  /// @param synapse  that was meant, in synapses()->all(); the pick is the branch that it is on
  void select(const std::optional<scene::Pick>& pick, std::optional<std::uint32_t> synapse = {});
  const std::optional<std::uint32_t>& selected_synapse() const { return selected_synapse_; }
  /// The synapse that is drawn there, before all branches; and its branch.
  std::optional<std::pair<std::uint32_t, scene::Pick>> pick_synapse(const QPointF& place) const;
  /// What is drawn at a place of this widget: to half a pixel, else the nearest branch within a few. A spine is its section.
  std::optional<scene::Pick> pick(const QPointF& place);

  /// Shows a simulation on the branches, at its first moment and standing still.
  void play(scene::Playback playback);
  /// Shows none any more, as what it was read from is damaged; `why` says so.
  void put_away_playback(const QString& why);
  const scene::Playback* playback() const { return playback_ ? &*playback_ : nullptr; }
  /// How it is shown, and the moment (View::activity).
  scene::ActivityView activity() const;
  void change(const scene::ActivityView& activity);
  double time() const;  // ms
  /// To the nearest moment that the simulation has.
  void set_time(double milliseconds);
  bool playing() const { return playing_; }
  void set_playing(bool playing);
  float rate() const { return rate_; }  // ms of activity a second
  void set_rate(float rate) { rate_ = rate; }

  /// Shows these synapses, these surfaces from now on.
  void show(scene::Synapses synapses);
  void show(scene::Surfaces surfaces);
  const scene::Synapses* synapses() const { return dressing_.synapses ? &*dressing_.synapses : nullptr; }
  const scene::Surfaces& surfaces() const { return dressing_.surfaces; }
  /// Of the whole forest, or of the surfaces where there is none.
  frame::Camera whole() const;

  /// The picture alone, in full, at its size on the screen.
  frame::Image picture();
  /// What is seen, with legend and scale.
  QImage seen();

  struct Figures {
    float frames_per_second = 0.f;  // while moving
    std::uint64_t segments = 0;     // drawn
    std::uint32_t neurons = 0;      // in sight
    std::size_t synapses = 0;       // drawn
    std::size_t triangles = 0;      // of skin
    std::uint32_t samples = 1;
    float error = 0.f;  // acceptable, pixels
  };
  const Figures& figures() const { return figures_; }
  QString renderer_name() const { return renderer_name_; }

 Q_SIGNALS:
  void changed();                     // the settings, by hand or otherwise
  void recoloured();                  // how neurons are shown
  void selected();                    // something else, or nothing
  void opened();                      // another simulation
  void put_away(const QString& why);  // the simulation
  void moved();                       // its moment, or whether it plays
  void drawn();
  void settled();  // the picture is finished
  /// The OpenGL context is of no use any more: whoever shows this widget must give it a new window (Window::renew). Its
  /// renderer is gone; a new one is made with the new context.
  void lost();
  /// Drawing goes on after something was lost, by another renderer or in another context; a sentence says why.
  void recovered(const QString& sentence);
  void failed(const QString& sentence);

 protected:
  void initializeGL() override;
  void resizeGL(int width, int height) override;
  void paintGL() override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void keyReleaseEvent(QKeyEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;

 private:
  enum class Stage { moving, refining, finished };

  struct Glide {
    scene::CameraPath path;
    frame::Camera end;
    float seconds;
    bool whole = false;                   // whole views, not cameras alone
    std::vector<scene::View> views = {};  // of a path, which is flown along next …
    bool returns = false;                 // … as this glide leads back to its beginning
    QElapsedTimer clock{};
  };

  void set_camera(const frame::Camera& camera);
  void touch();                 // something changed: draw, and refine once it stands still
  void draw_anew();             // the same where nothing moved, but what is shown on the branches changed
  void advance(float seconds);  // glide and flight
  void glide_on();
  /// Where the wheel goes: what was under the mouse as it began to turn; none where nothing is.
  std::optional<Vec3> goal_under(const QPointF& place);
  void make_renderer();  // in the current context; throws
  void release();        // what lies in the current context
  void recover(const std::string& why);
  bool flies() const { return !held_.empty(); }
  void draw_moving(const scene::Budget& budget);
  void draw_still(std::uint32_t samples, std::uint32_t first, std::uint32_t last,
                  const DressingLimits& limits = {});
  void draw_part(const scene::View& view, std::uint32_t first, std::uint32_t last,
                 const DressingLimits& limits);
  /// The branches of the selected neuron in the colours of their values, so near to the eye that nothing hides them. None where
  /// they are not drawn as branches are, or are seen through.
  std::vector<frame::Overlay> in_front(const scene::View& view, const scene::Eye& eye,
                                       const scene::Chooser::Painter& painter) const;
  std::uint32_t samples_at_rest() const;
  void refine();
  void took(float milliseconds, scene::Budget& budget);
  void paint(const frame::Image& drawn, float softness);
  std::vector<scene::LegendEntry> legend() const;
  void annotate();
  bool layered(const scene::View& view) const;  // drawn layer by layer
  scene::Budget& budget();                      // of the picture that is to be drawn now
  frame::Viewport in_points() const { return {float(width()), float(height())}; }

  scene::Forest forest_;
  scene::Targets targets_;
  scene::Chooser chooser_;
  std::optional<Foveated> foveated_;      // on the processor; a card draws one picture, with detail by gaze
  const frame::Image* united_ = nullptr;  // its last picture, while that is what is shown
  Settings settings_;
  std::optional<scene::Playback> playback_;
  bool playing_ = false;
  float rate_ = 5.f;
  double window_ = 0.;  // ms of activity that the picture stands for
  scene::Colouring colouring_;
  std::vector<frame::Overlay> outline_, highlight_;
  std::optional<Vec3> pia_;  // which way it lies
  bool has_axons_;
  Dressing dressing_;
  std::optional<Selection> selection_;
  std::optional<std::uint32_t> selected_synapse_;
  std::unique_ptr<render::Renderer> renderer_;
  render::OpenGLRenderer* card_ = nullptr;          // the renderer when it is OpenGL's …
  const render::CpuRenderer* processor_ = nullptr;  // … or this one where there is no graphics card
  QString renderer_name_, why_lost_;
  Drawer drawer_ = Drawer::automatic;
  int losses_ = 0;  // of the graphics card

  Stage stage_ = Stage::moving;
  std::uint32_t refined_ = 0;  // samples that are drawn of the picture that is shown
  float sample_milliseconds_ = 20.f;
  float milliseconds_ = 0.f;  // of a moving picture, smoothed
  frame::Image softened_;
  scene::Budget budget_, gaze_budget_{scene::Budget::with_gaze};  // of a moving picture …
  scene::Budget standing_budget_ = scene::Budget::standing();     // … and of one in which only time goes on
  int warming_up_ = 2;  // the first pictures make programs and buffers: they are no measure
  Figures figures_;
  QTimer rest_;          // runs out when the picture has stood still
  QElapsedTimer moved_;  // since the view moved
  QElapsedTimer tick_;   // since the last step of flight
  std::optional<Glide> glide_;
  bool loop_ = false;
  struct Approach {
    QPointF place;
    Vec3 goal;  // in the world
    QElapsedTimer clock{};
  };
  std::optional<Approach> approach_;  // of the wheel
  std::set<int> held_;                // keys of flight
  bool fast_ = false;                 // with Shift
  QPointF pressed_, mouse_;
  bool dragged_ = false;
};

}  // namespace forest::studio
