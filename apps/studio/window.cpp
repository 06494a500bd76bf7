// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/window.h"

#include <QAction>
#include <QApplication>
#include <QClipboard>
#include <QCloseEvent>
#include <QDialogButtonBox>
#include <QDockWidget>
#include <QFile>
#include <QFileDialog>
#include <QLabel>
#include <QMenuBar>
#include <QMessageBox>
#include <QScreen>
#include <QScrollArea>
#include <QScrollBar>
#include <QSettings>
#include <QStatusBar>
#include <QTextBrowser>
#include <QVBoxLayout>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "forest/core/file.h"
#include "forest/io/png.h"

#include "apps/studio/activity_panel.h"
#include "apps/studio/save_name.h"
#include "apps/studio/section_panel.h"
#include "apps/studio/selection_panel.h"
#include "apps/studio/targets_panel.h"
#include "apps/studio/view_panel.h"
#include "apps/surface_files.h"
#include "apps/view_text.h"

namespace forest::studio {
namespace {

// What the mouse and the keys of flight do; menus tell the rest.
constexpr const char* gestures[][2] = {
    {"Drag", "orbit about the target (in fly mode: look around)"},
    {"Right drag, or Shift and drag", "move across the picture"},
    {"Wheel", "come nearer to, or go away from, what is under the mouse"},
    {"Click", "select a branch and its subarbor"},
    {"Double click", "select it and go there"},
    {"W A S D, Q E", "fly forward, left, back, right, down, up (Shift: four times as fast)"},
    {"Arrows", "turn the eye"},
};

// Scrolls up and down, and is never narrower than what is in it: no field is cut off.
class Scroll final : public QScrollArea {
 public:
  explicit Scroll(QWidget* parent) : QScrollArea(parent) {
    setWidgetResizable(true);
    setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  }
  QSize minimumSizeHint() const override {
    const int inside = widget() ? widget()->minimumSizeHint().width() : 0;
    return {std::max(300, inside + verticalScrollBar()->sizeHint().width() + 2 * frameWidth()),
            QScrollArea::minimumSizeHint().height()};
  }

 protected:
  bool eventFilter(QObject* of, QEvent* event) override {
    if (event->type() == QEvent::LayoutRequest) updateGeometry();  // what is in it has become wider
    return QScrollArea::eventFilter(of, event);
  }
};

}  // namespace

Window::Window(scene::Forest forest, const scene::View& view, const QString& title, circuit::NodeSets sets,
               Drawer drawer)
    : viewport_(new Viewport(std::move(forest), view, std::move(sets), drawer, this)) {
  setWindowTitle(tr("%1 – Brain Forest").arg(title));
  setCentralWidget(viewport_);
  setDockNestingEnabled(true);
  add_docks();
  add_menus();
  for (QLabel** label : {&pace_, &drawn_, &sight_, &quality_})
    statusBar()->addWidget(*label = new QLabel(this));
  statusBar()->addPermanentWidget(renderer_ = new QLabel(this));
  statusBar()->setSizeGripEnabled(false);
  pace_->setToolTip(tr("Pictures a second while the view moves"));
  drawn_->setToolTip(tr("Segments drawn of all there are: what is too small to be seen is drawn as fewer"));
  sight_->setToolTip(tr("Neurons of which something is in the picture"));
  quality_->setToolTip(tr("Samples a pixel and acceptable error of this picture"));
  renderer_->setToolTip(tr("Who draws"));

  panel_rest_.setSingleShot(true);
  panel_rest_.setInterval(100);
  connect(&panel_rest_, &QTimer::timeout, this, [this] {
    view_panel_->show_settings(viewport_->settings());
    activity_panel_->follow();
  });
  connect(viewport_, &Viewport::changed, this, [this] {
    section_panel_->show_settings(viewport_->settings());
    if (!panel_rest_.isActive()) panel_rest_.start();
  });
  connect(viewport_, &Viewport::recoloured, this,
          [this] { section_panel_->show_colouring(viewport_->colouring()); });
  connect(viewport_, &Viewport::selected, this, [this] {
    selection_panel_->show_facts(selected_facts());
    show_targets();
    activity_panel_->show_selection();
  });
  connect(viewport_, &Viewport::recoloured, this, &Window::show_targets);
  show_targets();
  connect(viewport_, &Viewport::opened, this, [this] {
    activity_panel_->show_activity();
    hide_what_is_empty();
    if (before_) return;
    activity_dock_->show();
    activity_dock_->raise();
  });
  connect(viewport_, &Viewport::moved, this, [this] { activity_panel_->follow(); });
  connect(
      viewport_, &Viewport::put_away, this,
      [this](const QString& why) {
        activity_panel_->clear_traces();
        activity_panel_->follow();
        hide_what_is_empty();
        tell(tr("The simulation is shown no more: %1").arg(why));
      },
      Qt::QueuedConnection);
  connect(viewport_, &Viewport::drawn, this, &Window::show_figures);
  connect(viewport_, &Viewport::lost, this, &Window::renew, Qt::QueuedConnection);
  // Queued: a status bar that is not shown yet would write over its figures.
  connect(
      viewport_, &Viewport::recovered, this,
      [this](const QString& sentence) {
        show_figures();
        tell(sentence);
        renderer_->setToolTip(sentence);
      },
      Qt::QueuedConnection);

  QSettings kept;
  resize(1280, 800);
  restoreGeometry(kept.value("window/geometry").toByteArray());
  resize(fitting(size()));
  restoreState(kept.value(panels_key()).toByteArray());
  section_dock_->setVisible(viewport_->settings().plane);  // whatever was there in an earlier session
  hide_what_is_empty();
  viewport_->setFocus();
}

// A card that was reset took the contexts of the picture and of the whole window with it: both are made anew.
void Window::renew() {
  takeCentralWidget()->setParent(nullptr);
  setParent(nullptr, windowFlags());
  setCentralWidget(viewport_);
  viewport_->setVisible(true);
  show();
  activateWindow();
  viewport_->setFocus();
}

QSize Window::fitting(const QSize& size) const {
  constexpr QSize frame(8, 40);
  const QSize room = screen()->availableSize();
  return {size.width() <= room.width() ? size.width() : room.width() - frame.width(),
          size.height() <= room.height() ? size.height() : room.height() - frame.height()};
}

void Window::hide_what_is_empty() {
  const bool plane = viewport_->settings().plane, activity = viewport_->playback();
  if (!plane) section_dock_->hide();
  if (!activity) activity_dock_->hide();
  section_dock_->toggleViewAction()->setEnabled(plane);
  activity_dock_->toggleViewAction()->setEnabled(activity);
  for (QAction* action : of_activity_) action->setEnabled(activity);
}

void Window::present(bool on) {
  if (on == before_.has_value()) return;
  if (on) {
    before_ = {saveGeometry(), saveState(), windowState()};
    for (QDockWidget* dock : findChildren<QDockWidget*>()) dock->hide();
  } else {
    restoreState(before_->panels);
    hide_what_is_empty();
  }
  menuBar()->setVisible(!on);
  statusBar()->setVisible(!on);
  setWindowState(on ? windowState() | Qt::WindowFullScreen : before_->state);
  if (!on) before_.reset();
  viewport_->setFocus();
}

bool Window::surfaces_alone() const { return viewport_->forest().instances().empty(); }

// Panels are remembered apart for windows that need others.
QString Window::panels_key() const {
  return surfaces_alone() ? "window/panels_of_surfaces" : "window/panels";
}

void Window::add_docks() {
  const Change change = [this](const std::function<void(Settings&)>& what) {
    Settings settings = viewport_->settings();
    what(settings);
    viewport_->change(settings);
  };
  view_panel_ = new ViewPanel(viewport_->settings(), change, this);
  selection_panel_ = new SelectionPanel(
      surfaces_alone() ? tr("There are no branches here to click: a surface is shown without a forest.")
                       : tr("Click a branch to see what it is.\nIts subarbor is lit; Esc puts it out."),
      this);
  auto* scroll = new Scroll(this);
  scroll->setWidget(view_panel_);
  targets_panel_ = new TargetsPanel(
      {[change](const scene::Appearance& who, const scene::Appearance& what, bool own_colour) {
         change([&](Settings& settings) { change_target(settings.view, who, what, own_colour); });
       },
       [this](const QString& expression) { return add_target(expression); },
       [change](const scene::Appearance& all, const scene::Appearance& who) {
         change([&](Settings& settings) { show_only(settings.view, all, who); });
       },
       [change] { change([](Settings& settings) { show_all(settings.view); }); }},
      this);
  section_panel_ =
      new SectionPanel(viewport_->forest(), viewport_->settings(), viewport_->colouring(), change, this);
  const std::pair<const char*, QWidget*> docks[] = {{"Selection", selection_panel_},
                                                    {"Targets", targets_panel_},
                                                    {"View", scroll},
                                                    {"Section", section_panel_}};
  QList<QDockWidget*> added;
  for (const auto& [name, widget] : docks) {
    auto* dock = new QDockWidget(tr(name), this);
    dock->setObjectName(name);
    dock->setWidget(widget);
    const bool section = widget == section_panel_;  // a picture of its own, for those who ask for it
    addDockWidget(section ? Qt::LeftDockWidgetArea : Qt::RightDockWidgetArea, dock);
    if (section) {
      section_dock_ = dock;
      connect(viewport_, &Viewport::changed, dock,
              [this, dock, shown = viewport_->settings().plane]() mutable {
                if (const bool wanted = viewport_->settings().plane; wanted != shown) {
                  dock->setVisible((shown = wanted) && !before_);
                  hide_what_is_empty();
                }
              });
    } else {
      added.push_back(dock);
    }
    dock->setVisible(!section && (widget == scroll || !surfaces_alone()));
  }
  if (surfaces_alone())
    targets_panel_->rest(tr("There are no neurons here: a surface is shown without a forest."));
  resizeDocks(added, {220, 260, 260}, Qt::Vertical);
  activity_panel_ = new ActivityPanel(
      *viewport_, [this](double milliseconds) { Q_EMIT clamped(milliseconds); }, this);
  activity_dock_ = new QDockWidget(tr("Activity"), this);
  activity_dock_->setObjectName("Activity");
  activity_dock_->setWidget(activity_panel_);
  addDockWidget(Qt::BottomDockWidgetArea, activity_dock_);
  activity_dock_->hide();  // until there is a simulation
}

template <class Row, class Value>
void Window::set(const Row& row, Value value) {
  Settings settings = viewport_->settings();
  row.set(settings, value);
  viewport_->change(settings);
}

void Window::add_menus() {
  struct Command {
    const char *menu, *name, *shortcut, *hint;
    std::function<void()> run;
  };
  const Command commands[] = {
      {"&File", "&Open activity…", "Ctrl+O", "Play a simulation on the branches: an activity file",
       [this] { open_activity(); }},
      {"&File", "Open s&ynapses…", "",
       "Show the synapses of a file: pack writes column.synapses beside column.forest",
       [this] { open_synapses(); }},
      {"&File", "Open su&rface…", "Ctrl+Shift+O",
       "Add the surface of a cortex: GIFTI, FreeSurfer's lh.pial, PLY, STL or OBJ",
       [this] { open_surface(); }},
      {"&File", "Colour the surface by a &map…", "",
       "Values or areas on the last surface: GIFTI, FreeSurfer's lh.thickness, or text",
       [this] { open_overlay(); }},
      {"&File", "&Save picture…", "Ctrl+S", "The forest alone as a PNG, smooth, at its size on the screen",
       [this] { save_picture(false); }},
      {"&File", "Save picture with &legend…", "Ctrl+Shift+S",
       "What is seen, with scale, directions and legend, as a PNG", [this] { save_picture(true); }},
      {"&File", "Add the view to a &path…", "Ctrl+K",
       "Appends the view as a line to a file that 'brainforest movie --path' films",
       [this] { record_view(); }},
      {"&File", "Pla&y a path…", "Ctrl+Shift+K", "Flies through the views of such a file; a click ends it",
       [this] { play_path(); }},
      {"&File", "Save &traces…", "Ctrl+T", "The histories of clamped compartments as a table (CSV)",
       [this] { save_traces(); }},
      {"&File", "&Quit", "Ctrl+Q", "Close the window; its panels are remembered", [this] { close(); }},
      {"&Edit", "&Copy view", "Ctrl+C", "Where the eye is and what colours mean, as one line of JSON",
       [this] { copy_view(); }},
      {"&Edit", "&Paste view", "Ctrl+V", "Go to a view that was copied", [this] { paste_view(); }},
      {"&Edit", "Copy &facts", "Ctrl+Shift+C", "The facts of the selected branch as JSON",
       [this] {
         if (const auto& s = viewport_->selection()) {
           nlohmann::ordered_json known = to_json(viewport_->forest(), *s);
           if (const auto& synapse = viewport_->selected_synapse())
             known["synapse"] = to_json(*viewport_->synapses(), *synapse);
           QApplication::clipboard()->setText(QString::fromStdString(known.dump()));
         }
       }},
      {"&Edit", "Select the &parent", "P", "The section that the selected one grows out of",
       [this] {
         if (const auto& s = viewport_->selection())
           if (const auto parent = parent_of(viewport_->forest(), s->pick)) viewport_->select(parent);
       }},
      {"&Edit", "C&lear the selection", "Esc", "Select nothing; ends full screen first",
       [this] { before_ ? present(false) : viewport_->select(std::nullopt); }},
      {"&View", "&Centre on the selection", "F", "Go to where the selected subarbor fills the picture",
       [this] { viewport_->centre(); }},
      {"&View", "&Whole forest", "Home", "Go back outside and see everything",
       [this] { viewport_->glide_to(viewport_->whole()); }},
      {"&View", "&Full screen", "F11", "The picture alone over the whole screen; F11 or Esc brings all back",
       [this] { present(!before_); }},
      {"&Activity", "&Play or pause", "Space", "Let the simulation go on, or stand still",
       [this] { viewport_->set_playing(!viewport_->playing()); }},
      {"&Activity", "Step &forward", ".", "To the next moment of the simulation",
       [this] { activity_panel_->step(1); }},
      {"&Activity", "Step &back", ",", "To the moment before", [this] { activity_panel_->step(-1); }},
      {"&Activity", "To the &beginning", "Ctrl+Home", "To the first moment",
       [this] { viewport_->set_time(-INFINITY); }},
      {"&Activity", "&Clear traces", "Ctrl+Backspace", "Forget the histories that are shown",
       [this] { activity_panel_->clear_traces(); }},
      {"&Help", "&Keys and mouse", "F1", "What the keys and the mouse do", [this] { explain(); }},
  };
  const auto menu = [this](const char* name) {
    for (QAction* action : menuBar()->actions())
      if (action->text() == tr(name)) return action->menu();
    return menuBar()->addMenu(tr(name));
  };
  const auto add = [this](QMenu* to, const char* name, const char* shortcut, const char* hint) {
    QAction* action = to->addAction(tr(name));
    action->setShortcut(QKeySequence(shortcut));
    action->setStatusTip(tr(hint));
    action->setToolTip(tr(hint));
    addAction(action);  // keys are to work while the menus are hidden
    return action;
  };
  for (const char* name : {"&File", "&Edit", "&View", "&Activity", "&Panels", "&Help"}) menu(name);
  for (const Command& c : commands) {
    QAction* action = add(menu(c.menu), c.name, c.shortcut, c.hint);
    connect(action, &QAction::triggered, this, c.run);
    if (menu("&Activity")->actions().contains(action)) of_activity_.push_back(action);
    if (action->shortcut() != QKeySequence("Ctrl+Shift+K")) continue;
    QAction* loop = add(menu(c.menu), "&Loop paths", "Ctrl+L",
                        "From the end of a path back to its beginning, and along it again");
    loop->setCheckable(true);
    connect(loop, &QAction::toggled, viewport_, &Viewport::set_loop);
  }
  QMenu* view = menu("&View");
  view->addSeparator();
  for (const Toggle& toggle : toggles()) {
    QAction* action = add(view, toggle.name, toggle.shortcut, toggle.hint);
    action->setCheckable(true);
    connect(action, &QAction::triggered, this, [this, &toggle](bool on) { set(toggle, on); });
    const auto show = [this, action, &toggle] {
      action->setChecked(toggle.value(viewport_->settings()));
      action->setEnabled(toggle.usable(viewport_->settings()));
    };
    connect(viewport_, &Viewport::changed, action, show);
    show();
  }
  view->addSeparator();
  for (const Choice& choice : choices())
    connect(add(view, choice.name, choice.shortcut, choice.hint), &QAction::triggered, this, [this, &choice] {
      set(choice, (choice.value(viewport_->settings()) + 1) % int(choice.words.size()));
    });
  int number = 0;
  for (QDockWidget* dock : findChildren<QDockWidget*>()) {
    QAction* action = dock->toggleViewAction();
    action->setShortcut(QKeySequence(QString("Ctrl+%1").arg(++number)));
    addAction(action);
    menu("&Panels")->addAction(action);
  }
}

void Window::show_figures() {
  const Viewport::Figures& f = viewport_->figures();
  const QLocale locale;
  pace_->setText(f.frames_per_second > 0.f ? tr("%1 frames/s").arg(double(f.frames_per_second), 0, 'f', 0)
                                           : tr("– frames/s"));
  drawn_->setText(tr("%1 of %2 segments")
                      .arg(locale.toString(qulonglong(f.segments)),
                           locale.toString(qulonglong(viewport_->forest().segment_total()))));
  sight_->setText(tr("%1 of %2 neurons in sight")
                      .arg(locale.toString(f.neurons),
                           locale.toString(qulonglong(viewport_->forest().instances().size()))));
  quality_->setText(tr(f.samples == 1 ? "%1 sample, error %2 pixels" : "%1 samples, error %2 pixels")
                        .arg(f.samples)
                        .arg(double(f.error), 0, 'f', 1));
  renderer_->setText(viewport_->renderer_name());
  share_status_bar();
}

void Window::share_status_bar() {
  constexpr int between = 8;
  int room = width() - between;
  for (QLabel* label : {drawn_, sight_, renderer_, pace_, quality_}) {  // the most telling first
    room -= label->sizeHint().width() + between;
    label->setVisible(room >= 0);
  }
}

void Window::resizeEvent(QResizeEvent* event) {
  QMainWindow::resizeEvent(event);
  share_status_bar();
}

void Window::show_targets() {
  std::optional<scene::Branch> selected;
  if (const auto& s = viewport_->selection()) selected = scene::Branch{s->pick.instance, s->pick.section};
  targets_panel_->show_rows(
      target_rows(viewport_->targets(), viewport_->settings().view, viewport_->colouring(), selected));
}

QString Window::add_target(const QString& expression) {
  try {
    scene::Appearance who, what;
    who.name = expression.toStdString();
    what.visible = true;
    if (viewport_->targets().find(who.name).empty()) return tr("No neuron belongs to that.");
    Settings settings = viewport_->settings();
    change_target(settings.view, who, what);
    viewport_->change(settings);
    return {};
  } catch (const std::exception& error) {
    return QString::fromUtf8(error.what());
  }
}

void Window::copy_view() {
  QApplication::clipboard()->setText(QString::fromStdString(viewport_->text()));
  statusBar()->showMessage(tr("The view is on the clipboard as one line of JSON."), 4000);
}

void Window::record_view() {
  if (path_.isEmpty())
    path_ = QFileDialog::getSaveFileName(this, tr("Path of views"), "views.jsonl", tr("Views (*.jsonl)"),
                                         nullptr, QFileDialog::DontConfirmOverwrite);
  if (path_.isEmpty()) return;
  QFile file(path_);
  const std::string line = viewport_->text() + "\n";
  if (!file.open(QIODevice::Append) || file.write(line.data(), qint64(line.size())) != qint64(line.size())) {
    QMessageBox::warning(this, tr("Path of views"),
                         tr("%1 cannot be written: %2").arg(path_, file.errorString()));
    path_.clear();
    return;
  }
  statusBar()->showMessage(tr("The view was added to %1").arg(path_), 3000);
}

void Window::play_path() {
  const QString path =
      QFileDialog::getOpenFileName(this, tr("Path of views"), path_, tr("Views (*.jsonl);;All files (*)"),
                                   nullptr, QFileDialog::DontUseNativeDialog);
  if (path.isEmpty()) return;
  try {
    viewport_->fly_along(read_views(path.toStdString(), viewport_->forest().circuit().up));
  } catch (const std::exception& error) {
    QMessageBox::warning(this, tr("Path of views"), QString::fromUtf8(error.what()));
  }
}

void Window::paste_view() {
  try {
    const std::string text = QApplication::clipboard()->text().toStdString();
    const Vec3& up = viewport_->forest().circuit().up;
    Settings settings = viewport_->settings();
    set_view(settings, scene::parse_view(text, "clipboard", up), viewport_->forest().soma_bounds().centre());
    settings.skin = asks_for_skin(
        [&](const scene::View& unless) { return scene::parse_view(text, "clipboard", up, &unless); });
    viewport_->change(settings);
  } catch (const std::exception& error) {
    statusBar()->showMessage(QString::fromUtf8(error.what()), 8000);
  }
}

void Window::save_picture(bool as_seen) {
  const auto path = save_name(this, {tr("Save picture"), "forest.png", "png", tr("Pictures (*.png)")});
  if (!path) return;
  try {
    if (as_seen) {
      write_image(path->toStdString(), viewport_->seen());
    } else {
      const frame::Image image = viewport_->picture();
      io::write_png(path->toStdString(), image.width, image.height, image.pixels);
    }
    statusBar()->showMessage(tr("Saved %1").arg(*path), 6000);
  } catch (const std::exception& error) {
    QMessageBox::warning(this, tr("Save picture"), QString::fromUtf8(error.what()));
  }
}

const std::vector<reports::Trace>& Window::traces() const { return activity_panel_->traces(); }

QRect Window::raster() const { return activity_panel_->raster(); }

void Window::tell(const QString& sentence) {
  statusBar()->showMessage(sentence, 15'000);
  std::fputs(("brainforest-studio: " + sentence + "\n").toUtf8().constData(), stderr);
}

void Window::open_activity() {
  open_with(tr("Open activity"), tr("Activity files (*.activity)"), [this](const std::string& path) {
    viewport_->play(scene::Playback::open(viewport_->forest(), path));
  });
}

std::vector<Fact> Window::selected_facts() const {
  std::vector<Fact> all;
  if (const auto& synapse = viewport_->selected_synapse()) all = facts(*viewport_->synapses(), *synapse);
  if (const auto& selection = viewport_->selection())
    std::ranges::move(facts(viewport_->forest(), *selection), std::back_inserter(all));
  return all;
}

void Window::open_with(const QString& title, const QString& files,
                       const std::function<void(const std::string&)>& open) {
  const QString path = QFileDialog::getOpenFileName(this, title, {}, files + tr(";;All files (*)"), nullptr,
                                                    QFileDialog::DontUseNativeDialog);
  if (path.isEmpty()) return;
  try {
    open(path.toStdString());
  } catch (const std::exception& error) {
    QMessageBox::warning(this, title, QString::fromUtf8(error.what()));
  }
}

void Window::open_synapses() {
  open_with(tr("Open synapses"), tr("Synapses (*.synapses)"), [this](const std::string& path) {
    viewport_->show(scene::Synapses::open(path, viewport_->forest()));
  });
}

void Window::open_surface() {
  open_with(tr("Open surface"),
            tr("Surfaces (*.gii *.pial *.white *.inflated *.sphere *.smoothwm *.ply *.stl *.obj)"),
            [this](const std::string& path) {
              scene::Surfaces surfaces = viewport_->surfaces();
              const bool first = surfaces.empty();
              add_surface(surfaces, path);
              viewport_->show(std::move(surfaces));
              if (first && viewport_->forest().instances().empty()) viewport_->glide_to(viewport_->whole());
            });
}

void Window::open_overlay() {
  if (viewport_->surfaces().empty()) {
    statusBar()->showMessage(tr("No surface is open: open one first, then what colours it."), 6000);
    return;
  }
  open_with(tr("Colour the surface"), tr("Values and areas (*.gii *.thickness *.curv *.sulc *.area *.txt)"),
            [this](const std::string& path) {
              scene::Surfaces surfaces = viewport_->surfaces();
              add_overlay(surfaces, path);
              viewport_->show(std::move(surfaces));
            });
}

void Window::save_traces() {
  if (traces().empty()) {
    statusBar()->showMessage(tr("No compartment is clamped: click a branch while a simulation is shown."),
                             6000);
    return;
  }
  const auto path = save_name(this, {tr("Save traces"), "traces.csv", "csv", tr("Tables (*.csv)")});
  if (!path) return;
  try {
    write_file(path->toStdString(), csv_of(viewport_->playback()->activity().facts(), traces()));
    statusBar()->showMessage(tr("Saved %1").arg(*path), 6000);
  } catch (const std::exception& error) {
    QMessageBox::warning(this, tr("Save traces"), QString::fromUtf8(error.what()));
  }
}

std::vector<Window::Key> Window::keys() const {
  std::vector<Key> all;
  for (const auto& [gesture, what] : gestures) all.push_back({tr(gesture), {}, tr(what)});
  for (QAction* menu : menuBar()->actions())
    for (QAction* action : menu->menu()->actions()) {
      if (action->shortcut().isEmpty()) continue;
      const QString name = action->text().remove('&').remove("…");
      all.push_back({action->shortcut().toString(QKeySequence::NativeText), name,
                     action->statusTip()});  // panels have no hint beside their name
    }
  return all;
}

void Window::explain() {
  QString text = "<table cellspacing='4'>";
  for (const Key& key : keys())
    text += QString("<tr><td><b>%1</b>&nbsp;&nbsp;</td><td>%2</td></tr>")
                .arg(key.key.toHtmlEscaped(),
                     key.name.isEmpty()   ? key.what.toHtmlEscaped()
                     : key.what.isEmpty() ? key.name.toHtmlEscaped()
                                          : QString("%1 <span style='color:#8c99ac'>– %2</span>")
                                                .arg(key.name.toHtmlEscaped(), key.what.toHtmlEscaped()));
  auto* box = new QDialog(this);
  box->setObjectName("keys");
  box->setWindowTitle(tr("Keys and mouse"));
  box->setAttribute(Qt::WA_DeleteOnClose);
  auto* list = new QTextBrowser(box);  // scrolls: the table is higher than many screens
  list->setFrameShape(QFrame::NoFrame);
  list->setHtml(text + "</table>");
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close, box);
  connect(buttons, &QDialogButtonBox::rejected, box, &QDialog::reject);
  auto* layout = new QVBoxLayout(box);
  layout->addWidget(list);
  layout->addWidget(buttons);
  const QSize room = screen()->availableSize();
  box->resize(std::min(640, room.width() * 9 / 10),
              std::min({720, height() * 9 / 10, room.height() * 8 / 10}));
  box->show();
  Q_EMIT explained();
}

void Window::closeEvent(QCloseEvent* event) {
  QSettings kept;
  kept.setValue("window/geometry", before_ ? before_->geometry : saveGeometry());
  kept.setValue(panels_key(), before_ ? before_->panels : saveState());
  QMainWindow::closeEvent(event);
}

void write_image(const std::filesystem::path& path, const QImage& seen) {
  const QImage image = seen.convertToFormat(QImage::Format_RGBA8888);
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < image.height(); ++y)
    pixels.insert(pixels.end(), image.constScanLine(y), image.constScanLine(y) + 4 * image.width());
  io::write_png(path, std::uint32_t(image.width()), std::uint32_t(image.height()), pixels);
}

}  // namespace forest::studio
