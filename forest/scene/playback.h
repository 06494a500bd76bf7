// SPDX-License-Identifier: Apache-2.0
// A simulation on the forest: for every segment that a picture shows, the palette entry of the value that its branch has at
// a moment. Detail of the activity follows the eye as detail of shape does: near neurons are coloured by compartments, far
// ones by means of sections, of branches, at last of all of it. Only values of neurons in the cut are read.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "forest/reports/activity.h"
#include "forest/scene/cut.h"
#include "forest/scene/view.h"

namespace forest::scene {

struct PlaybackOptions {
  double window =
      0.;  // ms that a picture stands for, up to its moment: of the steps within, the greatest is shown
  float pixels = 16.f;  // that one value may stand for, along a branch
  // One an instance: those that are not simulated have no value and no spike. None: all are.
  std::span<const frame::State> states = {};
};

class Playback {
 public:
  /// Throws InputError that names what does not fit: the number of neurons, a neuron's shape, a section.
  /// @param name  stands for the activity file in errors
  Playback(Forest forest, reports::Activity activity, const std::string& name = "activity");
  static Playback open(const Forest& forest, const std::filesystem::path& path);

  const reports::Activity& activity() const { return activity_; }
  /// `view` with a time of the simulation, and no neuron stands out that is not there.
  ActivityView fitted(ActivityView view) const;
  /// What is shown when nobody chooses: −80 to 20 mV, or the whole range of another unit.
  ActivityView view() const;
  double begin() const { return activity_.facts().start; }  // ms, of the first step and of the last
  double end() const { return activity_.facts().time(activity_.facts().steps - 1); }
  /// Else there are spikes alone, and a picture shows `flashes` instead of `colour`.
  bool has_values() const;
  /// Whether any value is a number; else branches show that there is none.
  bool numbers() const;
  /// ms: a moment at which as many flashes as ever are to be seen; the first one when there are no spikes.
  double busiest(const ActivityView& view) const;
  /// The step that is shown at a time, the last one not after it; the first or the last for times beyond.
  std::uint64_t step_at(double time) const;

  /// Fills Cut::entries. A segment has the value of the compartment at the middle of what it stands for, or of the section,
  /// branch or neuron around that; what was not reported, no_value_entry. A report of somata alone colours whole neurons.
  /// Over that, spikes: a flash leaves the soma at the time of the spike, runs along the axon and fades.
  void colour(Cut& cut, const Eye& eye, const ActivityView& view, const PlaybackOptions& options = {});

  /// The spikes that are under way, as marks over the branches that they run along: on axons, and on somata. A new one is
  /// spike_entry and widest; fading it becomes fading_entry and sinks into its branch. None is thinner than a share of the
  /// picture's height, so that they are found in a poster as on a screen, and they lie so near to the eye that they are seen
  /// through the tissue before them. Of neurons that show.
  /// @param height  of the picture, pixels
  std::vector<frame::Overlay> flashes(const frame::Camera& camera, float height, const Colouring& colouring,
                                      const ActivityView& view, const PlaybackOptions& options = {});

  /// The level at which a neuron is coloured when 1 µm of it covers so many pixels where it is nearest.
  reports::Level level(std::uint32_t row, float magnification, float pixels = PlaybackOptions().pixels) const;
  /// The compartment of a picked segment, for its history. None where nothing was reported.
  struct Compartment {
    std::uint32_t row = 0, index = 0;  // of its neuron in Activity::rows(), and within that
  };
  std::optional<Compartment> compartment(std::uint32_t instance, std::uint32_t segment) const;

  /// Of all calls of `colour` and `flashes` since `begin_picture`.
  struct Figures {
    std::uint64_t neurons = 0, values = 0, segments = 0,
                  flashes = 0;       // neurons reported and in the cut; values read
    double gather = 0., paint = 0.;  // milliseconds
  };
  const Figures& figures() const { return figures_; }
  void begin_picture() {
    figures_ = {};
    counted_.assign(shown_.size(), false);
  }

 private:
  static constexpr std::size_t levels = 4;
  // Of a layout: where each segment of its shape finds its value, in each level.
  struct Table {
    std::array<std::vector<std::uint32_t>, levels> value;  // all ones: none
    std::array<float, levels> length{};                    // µm that a value stands for
  };
  // Of a shape of the forest.
  struct Shape {
    std::uint32_t first_segment = 0;
    std::vector<float>
        distance;  // of each segment along the branches from the soma; negative where no spike runs
  };
  struct Shown {
    bool in_sight = false, simulated = true;
    reports::Level level = reports::Level::compartment;
    std::uint64_t first = 0;                   // in codes_
    std::uint32_t spikes = 0, spikes_end = 0;  // in spikes_
  };

  void read(const Eye& eye, const PlaybackOptions& options, double time);
  void find_spikes(double time, const ActivityView& view, const PlaybackOptions& options);
  /// Segments [first, first + count) of a neuron.
  void paint(std::uint32_t instance, std::uint32_t first_segment, std::uint32_t count,
             const std::array<std::uint8_t, 256>& entry_of, const ActivityView& view, double time,
             double window, std::uint8_t* out) const;

  Forest forest_;
  reports::Activity activity_;
  std::vector<Table> tables_;            // of each layout
  std::vector<Shape> shapes_;            // of each distinct neuron
  std::vector<std::uint32_t> row_of_;    // of each instance; all ones: not reported
  float farthest_ = 0.f;                 // of all places where spikes run, µm
  std::vector<Shown> shown_;             // of each instance
  std::vector<std::uint32_t> in_sight_;  // instances
  std::vector<bool> counted_;            // of each instance, in this picture; it may come in several parts
  std::vector<reports::Wanted> wanted_;
  std::vector<reports::Code> codes_;
  std::vector<reports::Spike> spikes_;  // of neurons in sight, by neuron
  Figures figures_;
};

/// Capsules of flashes in a picture, at most; those of the latest spikes come first.
inline constexpr std::size_t most_flash_marks = 100'000;

/// The colours behind flashes: every branch in a quiet tint of its own.
void make_quiet(frame::Palette& palette, Background background);

}  // namespace forest::scene
