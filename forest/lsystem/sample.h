// SPDX-License-Identifier: Apache-2.0
// Traced examples that a grammar draws from: rows of numbers, each with the branches that belong to it. Which row is drawn
// depends on how like its conditions are to what is wanted, so that branches come as they came in the traced neurons at such
// a place: nonparametric conditional distributions, as KDE-Neuron has them (Torben-Nielsen, Vanderlooy & Postma 2008,
// Neuroinformatics 6:257).
//
//   sample forks(kind =, cell !=, tips ~ 0.3, path ~ 40 -> part, daughters) =
//     3 12 1.4 52 -> 0.25 2 | 0 1 0 1.2 : 0.5 3.1 0 1.1, 2 6.4 0.8 0.9 | 0 1 0 0.8 : -1 4 0 0.8;
//     3 14 0.7 90 -> 0.5 2 | …
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/random.h"
#include "forest/core/vec.h"

namespace forest::lsystem {

inline constexpr float as_high = 1e-4f;  // µm: by no more a level step leaves its height, which is rounding

/// A branch as it was traced, from its beginning at the origin.
struct Trace {
  struct Stop {
    Vec3 at;             // µm
    float diameter = 0;  // µm
  };
  Vec3 heading;                   // unit: of the branch that it leaves, at its end
  Vec3 last_step = Vec3::Zero();  // unit: of that branch's last step; zero where it is not told
  float diameter = 0.f;           // at its beginning, µm
  std::vector<Stop> stops;        // at least one
  // Worked out by Sample::add().
  Vec3 ahead = Vec3::Zero();        // where it heads at its end
  Vec3 own_last = Vec3::Zero();     // unit: its own last step
  std::vector<float> lengths = {};  // from its beginning to each place, µm

  float steepest = 0.f;  // how fast its diameter changes at most, µm a µm
  bool level = true;     // all along

  const Vec3& end() const { return stops.back().at; }
  float length() const { return lengths.back(); }
};

/// The places of a traced branch that is to be drawn `scale` times as long, before it is so scaled. Its steps are not stretched:
/// how far apart points are, and how far z leaps between them, is a tracer's habit. Some that follow one another are left out, or
/// made twice, where the end then lies nearest to where it should; what is still missing all of them take up.
struct Course {
  std::vector<Vec3> places;
  std::vector<float> lengths;  // from its beginning to each place, µm, as it was traced

  Course(const Trace& t, float scale);

  /// How many steps are level. Of those that are not so large a share becomes so, those first that go least along z, and the next that
  /// is not goes their way along z, too; below 0, of those that are so large a share climbs with the next that does.
  void levels(float share);
  /// How much steps differ in how steep they are: up and down each go as far as before, but shares of a step that go along z are taken
  /// to this power, so that above 1 flat ones become flatter and steep ones steeper. Level ones remain so.
  void stairs(float power);
  /// How kinked it is: angles between steps become about so many times as large, and their differences as by this power, by moving
  /// places in the plane of the slice to or from the line between those beside them. Its end, and all z, stay.
  void kinks(float times, float power);
  /// Its end so many µm farther along z: each step in proportion to how far it goes along z, but for what would change them by more
  /// than two fifths, which those that are not level take evenly. Level ones remain so, unless all are.
  void climb(float by);
  /// How high its places would lie then.
  std::vector<float> climbed(float by) const;
  float length() const { return lengths.back(); }
};

/// At a place of a branch.
struct Calibre {
  float diameter;  // µm
  float change;    // of how the diameter changes after the first place, the share up to here
};

/// The diameters of one traced branch for another, place by place. They are not drawn out: how often a tracer sets another, and how
/// they waver, is his habit. Where there are more places or fewer, some that follow one another come twice or are left out. The first
/// place has the first diameter, since by how much that differs from what the branch leaves belongs to the fork; the last the last.
/// @param along  from the beginning to each place, µm; at least one
std::vector<Calibre> calibres(const Trace& of, std::span<const float> along);

/// Where a path heads that ends with these places: the unit vector over its last `reach` µm, or over all of it when it is
/// shorter; zero when it has no length. A path through `from`, then through the stops.
inline constexpr float heading_reach = 20.f;
Vec3 heading_at_end(const Vec3& from, std::span<const Trace::Stop> stops);

/// Values by bin: lookup(x) is the value of the first bin whose upper edge is >= x, else the last; of no number none.
struct Table {
  std::string name;
  std::vector<double> edges, values;  // edges strictly increasing

  double lookup(double x) const;
};

class Sample {
 public:
  enum class Match : std::uint8_t {
    like,     // by a normal kernel of this width
    same,     // only rows that have this number
    another,  // only rows that have another one, if there are any
  };
  struct Condition {
    std::string name;
    Match match = Match::like;
    double width = 1.;   // of the kernel; or …
    Table widths = {};   // by the number of another condition, which must be the same
    std::size_t by = 0;  // that condition
  };

  std::string name;
  std::vector<Condition> conditions;
  std::vector<std::string> outcomes;

  std::size_t rows() const { return branches_.size(); }
  void add(std::span<const double> conditions, std::span<const double> outcomes, std::vector<Trace> branches);
  /// To be called after the last row.
  void finish();
  /// Changes what all rows say to one condition, after the last.
  void ask(std::size_t condition, std::span<const double> of_rows);

  /// The number of a row. Every row's chance is the product of its kernels; where all are far from what is wanted, the
  /// nearest ones are drawn. Throws Error when no row has the numbers that must be the same.
  /// @param wanted  one number a condition, in their order
  std::size_t draw(std::span<const double> wanted, Random& random) const;
  double outcome(std::size_t row, std::size_t column) const {
    return outcome_values_[row * outcomes.size() + column];
  }
  std::span<const Trace> branches(std::size_t row) const { return branches_[row]; }

 private:
  struct Group {  // of rows that are the same where they must be
    std::vector<float> key;
    std::vector<std::uint32_t> rows;
    struct Column {
      std::size_t condition;
      float width;
    };
    std::vector<Column> another, like;  // of the other conditions; kernels first by which rows differ most
    std::vector<float> forbidden;       // of what must be another, one column after the other
    std::vector<float> columns;         // of kernels, in units of their widths, likewise
    std::vector<float> by_row;          // the same, row by row
  };
  std::vector<float> condition_values_;  // row by row
  std::vector<double> outcome_values_;
  std::vector<std::vector<Trace>> branches_;
  std::vector<Group> groups_;  // by key
};

}  // namespace forest::lsystem
