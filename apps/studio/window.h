// SPDX-License-Identifier: Apache-2.0
// The window: the forest in the middle, panels at the side, menus made from tables, and figures at the bottom.
#pragma once

#include <QMainWindow>
#include <filesystem>

#include "forest/reports/trace.h"

#include "apps/studio/viewport.h"

class QDockWidget;
class QLabel;

namespace forest::studio {

/// As PNG, whole or not at all; throws Error.
void write_image(const std::filesystem::path& path, const QImage& seen);

class ActivityPanel;
class SectionPanel;
class SelectionPanel;
class TargetsPanel;
class ViewPanel;

class Window final : public QMainWindow {
  Q_OBJECT

 public:
  Window(scene::Forest forest, const scene::View& view, const QString& title, circuit::NodeSets sets = {},
         Drawer drawer = Drawer::automatic);

  Viewport& viewport() { return *viewport_; }
  const std::vector<reports::Trace>& traces() const;
  QRect raster() const;  // where its colours are, on the screen
  /// What a gesture or a key does: the name of its command (none of a gesture), and a hint (none where the name says all).
  struct Key {
    QString key, name, what;
  };
  std::vector<Key> keys() const;

 Q_SIGNALS:
  void clamped(double milliseconds);  // another trace is shown, or none: how long it took to read
  void explained();                   // the keys are on the screen

 protected:
  void closeEvent(QCloseEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  // As large as the screen has room for, of which the frame takes some.
  QSize fitting(const QSize& size) const;
  void renew();                 // the window on the screen, and all contexts with it
  bool surfaces_alone() const;  // there is no forest: nothing to select, no targets
  QString panels_key() const;
  void add_docks();
  void hide_what_is_empty();  // panels that have nothing to show, and what acts on it
  /// The picture alone over the whole screen, as in an exhibit; or all as it was before.
  void present(bool on);
  void share_status_bar();             // figures that have no room are left out, rather than cut off
  void tell(const QString& sentence);  // in the status bar, and where the program was started
  void add_menus();
  void show_figures();
  void show_targets();
  QString add_target(const QString& expression);
  void copy_view();
  void paste_view();
  void record_view();
  void play_path();
  void save_picture(bool as_seen);
  void explain();
  // Asks for a file and opens it; says what is wrong with it.
  void open_with(const QString& title, const QString& files,
                 const std::function<void(const std::string&)>& open);
  void open_activity();
  void open_synapses();
  void open_surface();
  void open_overlay();
  std::vector<Fact> selected_facts() const;
  void save_traces();
  template <class Row, class Value>
  void set(const Row& row, Value value);

  Viewport* viewport_;
  ViewPanel* view_panel_;
  SelectionPanel* selection_panel_;
  TargetsPanel* targets_panel_;
  SectionPanel* section_panel_;
  ActivityPanel* activity_panel_;
  QDockWidget *activity_dock_, *section_dock_;
  QList<QAction*> of_activity_;  // that need a simulation
  struct Before {                // a picture that is presented
    QByteArray geometry, panels;
    Qt::WindowStates state;
  };
  std::optional<Before> before_;
  QLabel *pace_, *drawn_, *sight_, *quality_, *renderer_;
  QString path_;       // where views are recorded
  QTimer panel_rest_;  // the panel follows a moving view a few times a second
};

}  // namespace forest::studio
