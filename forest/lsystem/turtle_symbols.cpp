// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <bit>
#include <iterator>

#include "forest/lsystem/traced_branch.h"
#include "forest/lsystem/turtle.h"

namespace forest::lsystem {
namespace {

constexpr std::size_t tracing_needs = 3;
constexpr auto tracing_values = std::bit_cast<std::array<double, tracing_takes>>(Tracing{});

constexpr double round_soma[] = {0., 0., 0., 0.};
constexpr double spines_as_usual[] = {1.2, .5, .15, .3, 0.};
constexpr double shun_as_usual[] = {10.};

constexpr TurtleSymbol symbol_table[] = {
    {"F", "length, diameter", "draw a segment; it tapers to the diameter, when given", Action::draw, 0, 2},
    {"f", "length", "move without drawing", Action::move, 0, 1},
    {"+", "angle", "turn left", Action::turn_left, 0, 1},
    {"-", "angle", "turn right", Action::turn_right, 0, 1},
    {"&", "angle", "pitch down", Action::pitch_down, 0, 1},
    {"^", "angle", "pitch up", Action::pitch_up, 0, 1},
    {"\\", "angle", "roll left", Action::roll_left, 0, 1},
    {"/", "angle", "roll right", Action::roll_right, 0, 1},
    {"|", "", "turn around", Action::turn_around, 0, 0},
    {"$", "", "roll until the left is horizontal", Action::level, 0, 0},
    {"[", "", "begin a branch: remember everything", Action::push, 0, 0},
    {"]", "", "end a branch: be as at its beginning", Action::pop, 0, 0},
    {"!", "diameter", "set the diameter; alone, divide it by the square root of 2", Action::diameter, 0, 1},
    {"T", "strength, x, y, z",
     "from here on bend by strength towards a direction, (0, 1, 0) when not given; 0 ends it",
     Action::tropism, 1, 4},
    {"Soma", "diameter, a2, b2, a3, b3",
     "a soma here; with the others not round: seen along z its outline is diameter / 2 × (1 + a2 cos 2φ + b2 "
     "sin 2φ + "
     "a3 cos 3φ + b3 sin 3φ) from its middle, φ from +x to +y",
     Action::soma, 1, 5, round_soma},
    {"Axon", "", "what follows is axon", Action::axon, 0, 0},
    {"Basal", "", "what follows is basal dendrite", Action::basal, 0, 0},
    {"Apical", "", "what follows is apical dendrite", Action::apical, 0, 0},
    {"Glia", "", "what follows is a glial process", Action::glia, 0, 0},
    {"Kind", "number", "what follows is of this SWC type", Action::kind, 1, 1},
    {"Outward", "strength", "from here on bend away from the soma by strength; 0 ends it", Action::outward, 1,
     1},
    {"Flat", "strength, x, y, z",
     "from here on bend by strength into the plane across a direction, (0, 0, 1) when not given; 0 ends it",
     Action::flat, 1, 4},
    {"At", "x, y, z", "stand at a place, counted from the soma, without drawing", Action::place, 3, 3},
    {"Head", "x, y, z", "turn the shortest way to head into a direction", Action::head, 3, 3},
    {"Trace",
     "sample, row, branch, scale, mirror, turn, bent, like, thickness, thinnest, x, y, z, last, steep, "
     "stairs, kinked, kinks, climbing, about, levelled",
     "draw a branch of a sample's row as it was traced, times `scale`; mirror 1: x, 2: z, 3: both; turned "
     "about z by the share `turn` of "
     "the angle from what it left there to the heading; `bent` times as far from its chord; as thick as the "
     "branch of row `like` (below 0: its own), "
     "times `thickness`, at its end `last` (below 0: the same), and no thinner than `thinnest`; its end "
     "drawn aside by (x, y, "
     "z), all of it in "
     "proportion; `steep` times as far along z; how steep its "
     "steps are to the power of "
     "`stairs`; angles between them `kinked` times as large, and to the power of `kinks`; of "
     "what is drawn aside along z the share `climbing` in proportion to how far each step goes along it; "
     "turned about z by `about` degrees beside; and of its steps that are not level the share `levelled` "
     "becomes "
     "so, or below 0 of those that are as large a share climbs",
     Action::trace, int(tracing_needs), int(tracing_takes), std::span(tracing_values).subspan(tracing_needs)},
    {"Gauge", "sample, row, even",
     "from here on every diameter of `Trace` is the nearest of those that the first branch of the row has, "
     "which must rise; in the end all that is drawn under it is taken by the share `even`, 0 when not given, "
     "to having "
     "each as often as the x of its place says",
     Action::gauge, 2, 3},
    {"Fibre", "diameter", "a neuron without soma begins here: what is drawn next leaves this point",
     Action::fibre, 1, 1},
    {"Spiny", "density, reach, head, neck, spread, dice",
     "from here on what is drawn bears so many spines per µm, anywhere and to any side, as `dice`, a number "
     "of chance, "
     "says: heads `reach` from the axis (1.2), in logarithms with this spread (0.3), `head` and `neck` wide "
     "(0.5, 0.15), µm; density 0 ends it",
     Action::spiny, 1, 6, spines_as_usual},
    {"Avoid", "gap",
     "from here on keep this far from somata, the own one included, and below the pia, by bending around; "
     "below 0 ends it",
     Action::avoid, 1, 1},
    {"Seek", "strength",
     "from here on bend by strength to where attractors are denser, below 0 away from it; 0 ends it",
     Action::seek, 1, 1},
    {"Shun", "strength, reach",
     "from here on bend away from the nearest soma of another cell by strength, which falls with the "
     "distance by a "
     "factor of e within the reach, 10 µm when not given; 0 ends it",
     Action::shun, 1, 2, shun_as_usual},
    {"?P", "x, y, z", "after every step, where the turtle is here, counted from the soma", Action::ask_place,
     3, 3},
    {"?H", "x, y, z", "… and where it heads: a unit vector", Action::ask_heading, 3, 3},
    {"?S", "x, y, z", "… and the direction of the last step: a unit vector, 0 when nothing was drawn",
     Action::ask_step, 3, 3},
    {"?D", "depth, layer, above, below",
     "… how deep below the pia it is, in which layer, and how far from the upper and lower border of that",
     Action::ask_depth, 1, 4},
    {"?N", "distance, x, y, z",
     "… how far the surface of the nearest soma of another cell is, and the unit vector to its centre",
     Action::ask_near, 1, 4},
    {"?A", "density, x, y, z", "… how dense attractors are, and the unit vector to where they are denser",
     Action::ask_attraction, 1, 4},
};

static_assert([] {
  for (std::size_t i = 0; i < std::size(symbol_table); ++i)
    if (std::size_t(symbol_table[i].action) != i) return false;
  return true;
}());

}  // namespace

std::span<const TurtleSymbol> turtle_symbols() { return symbol_table; }

}  // namespace forest::lsystem
