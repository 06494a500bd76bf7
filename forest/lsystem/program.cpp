// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/program.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "forest/core/error.h"

namespace forest::lsystem {
namespace {

constexpr double degree = std::numbers::pi / 180.;

constexpr Function function_table[] = {
    {"sin", 1, Op::sin, false, "sine of an angle in degrees"},
    {"cos", 1, Op::cos, false, "cosine of an angle in degrees"},
    {"tan", 1, Op::tan, false, "tangent of an angle in degrees"},
    {"asin", 1, Op::asin, false, "angle in degrees"},
    {"acos", 1, Op::acos, false, "angle in degrees"},
    {"atan", 1, Op::atan, false, "angle in degrees"},
    {"atan2", 2, Op::atan2, false, "angle of (x, y) in degrees: atan2(y, x)"},
    {"exp", 1, Op::exp, false, "e to the power of x"},
    {"log", 1, Op::log, false, "natural logarithm"},
    {"sqrt", 1, Op::sqrt, false, "square root"},
    {"abs", 1, Op::abs, false, "absolute value"},
    {"floor", 1, Op::floor, false, "greatest whole number not above x"},
    {"ceil", 1, Op::ceil, false, "least whole number not below x"},
    {"round", 1, Op::round, false, "nearest whole number"},
    {"sign", 1, Op::sign, false, "-1, 0 or 1"},
    {"min", 2, Op::min, false, "the lesser"},
    {"max", 2, Op::max, false, "the greater"},
    {"pow", 2, Op::power, false, "x to the power of y, as x^y"},
    {"mod", 2, Op::modulo, false, "remainder of x / y, with the sign of y"},
    {"uniform", 2, Op::uniform, true, "from a to b, evenly"},
    {"normal", 2, Op::normal, true, "mean, standard deviation"},
    {"truncnormal", 4, Op::truncnormal, true, "mean, standard deviation, lowest, highest"},
    {"lognormal", 2, Op::lognormal, true, "mean and standard deviation of the logarithm"},
    {"gamma", 2, Op::gamma, true, "shape, scale: mean shape * scale"},
    {"exponential", 1, Op::exponential, true, "mean"},
    {"weibull", 2, Op::weibull, true, "shape, scale"},
    {"vonmises", 2, Op::vonmises, true, "mean direction in degrees, concentration"},
    {"poisson", 1, Op::poisson, true, "mean"},
    {"chance", 1, Op::chance, true, "1 with probability p, else 0"},
    {"dealt", 1, Op::dealt, true,
     "the neuron's card of n: 0 to n - 1, each once among neurons 0 to n - 1, n to 2 n - 1, …; the first of "
     "these are "
     "spread evenly over all"},
};

constexpr double nonsense =
    std::numeric_limits<double>::quiet_NaN();  // of impossible parameters; noticed where it is used

// The normal distribution kept to [low, high]: by rejection where most draws fall inside, else by inversion.
double truncated_normal(Random& random, double mean, double sd, double low, double high) {
  if (!(low <= high && sd >= 0.)) return nonsense;
  if (low <= mean - 0.5 * sd && high >= mean + 0.5 * sd)
    for (;;)
      if (const double x = random.normal(mean, sd); x >= low && x <= high) return x;
  return random.truncated_normal(mean, sd, low, high);
}

double normal(Random& random, double mean, double sd) {
  return sd >= 0. ? random.normal(mean, sd) : nonsense;
}

double exponential(Random& random, double mean) { return mean >= 0. ? random.exponential(mean) : nonsense; }

double gamma(Random& random, double shape, double scale) {
  return shape > 0. && std::isfinite(shape) && scale >= 0. ? random.gamma(shape, scale) : nonsense;
}

double weibull(Random& random, double shape, double scale) {
  return shape > 0. && scale >= 0. ? scale * std::pow(random.exponential(1.), 1. / shape) : nonsense;
}

double von_mises(Random& random, double mean, double concentration) {
  return concentration >= 0. ? random.von_mises(mean, concentration) : nonsense;
}

double chance(Random& random, double p) { return std::isnan(p) ? nonsense : double(random.uniform() < p); }

// Hörmann 1993, "The transformed rejection method for generating Poisson random variables": PTRS, for means from 10 on.
double poisson_of_many(Random& random, double mean) {
  const double b = .931 + 2.53 * std::sqrt(mean), a = -.059 + .02483 * b, alpha = 1.1239 + 1.1328 / (b - 3.4),
               surely = .9277 - 3.6224 / (b - 2.), log_mean = std::log(mean);
  for (;;) {
    const double u = random.uniform() - .5, v = 1. - random.uniform(), near = .5 - std::abs(u);
    if (near == 0.) continue;
    const double count = std::floor((2. * a / near + b) * u + mean + .43);
    if (near >= .07 && v <= surely) return count;
    if (count < 0. || (near < .013 && v > near)) continue;
    if (std::log(v * alpha / (a / (near * near) + b)) <= count * log_mean - mean - std::lgamma(count + 1.))
      return count;
  }
}

// Knuth 1969, in pieces of at most 32 so that the product does not vanish.
double poisson(Random& random, double mean) {
  constexpr double many = 1000., most = 1e6;
  if (!(mean >= 0. && mean <= most)) return nonsense;
  if (mean > many) return poisson_of_many(random, mean);
  double count = 0.;
  for (double left = mean; left > 0.; left -= 32.) {
    const double bound = std::exp(-std::min(left, 32.));
    for (double product = random.uniform(); product > bound; product *= random.uniform()) ++count;
  }
  return count;
}

// The cards lie in a ring, and a block of as many neurons takes one each, so that those of the first neurons, however many, are spread
// evenly around it: the halves of the ring take turns, in each of which chance says which is first, and so do the halves of these. When
// they are not as large as each other, chance says which is larger, and in which turn it is alone.
double dealt(const Random& random, double cards) {
  constexpr double most = 1e6;
  if (!(cards >= 1. && cards <= most && cards == std::floor(cards))) return nonsense;
  const auto count = std::uint32_t(cards);
  const std::uint64_t block = random.item() / count;
  auto place = std::uint32_t(random.item() % count);
  std::uint32_t first = Random(random.seed(), block, 0xdea1).below(count);
  constexpr std::uint32_t of_parts = 0x80000000;
  for (std::uint32_t size = count, part = 1; size > 1;) {
    Random draw(random.seed(), block, of_parts | part);
    const bool odd = size % 2, right_is_larger = odd && draw.below(2);
    const std::uint32_t turns = (size + 1) / 2, left = right_is_larger ? size - turns : turns,
                        alone = odd ? draw.below(turns) : turns;
    if (place > 2 * alone) ++place;  // as though both halves took that turn
    const std::uint32_t turn = place / 2;
    bool to_right = right_is_larger;
    if (turn != alone) {
      for (std::uint32_t i = 0; i < turn; ++i) draw.below(2);
      to_right = (place % 2 == 1) != (draw.below(2) == 1);
    }
    place = turn > alone && to_right != right_is_larger ? turn - 1 : turn;
    if (to_right) first += left;
    size = to_right ? size - left : left;
    part = 2 * part + to_right;
  }
  return first % count;
}

double modulo(double x, double y) { return x - y * std::floor(x / y); }

// 1 or 0; of what is no number that, which false and anything is not.
double truth(double x) { return std::isnan(x) ? x : double(x != 0.); }
double both(double x, double y) { return x == 0. || y == 0. ? 0. : x * y; }

// How many operands an instruction takes from the stack and how many results it leaves.
struct Effect {
  int taken, left;
};
Effect effect(const Instruction& instruction) {
  const Op op = instruction.op;
  switch (op) {
    case Op::constant:
    case Op::slot:
    case Op::cell:
      return {0, 1};
    case Op::store:
    case Op::jump_if_zero:
      return {1, 0};
    case Op::jump:
      return {0, 0};
    case Op::negate:
    case Op::logical_not:
    case Op::cell_at:
    case Op::table:
    case Op::outcome:
      return {1, 1};
    case Op::row:
      return {int(instruction.value), 1};
    default:
      break;
  }
  const auto row = std::ranges::find(function_table, op, &Function::op);
  return {row == std::end(function_table) ? 2 : row->parameters, 1};
}

}  // namespace

std::span<const Function> functions() { return function_table; }

double Table::lookup(double x) const {
  if (std::isnan(x)) return nonsense;
  const auto bin = std::size_t(std::ranges::lower_bound(edges, x) - edges.begin());
  return values[std::min(bin, values.size() - 1)];
}

std::size_t stack_depth(const Program& program) {
  // Counted as if no jump were taken, which is never too little: a branch that is jumped over only leaves
  // less.
  std::ptrdiff_t depth = 0, most = 0;
  for (const Instruction& i : program) {
    const Effect e = effect(i);
    most = std::max(most, depth);
    depth += e.left - e.taken;
    most = std::max(most, depth);
  }
  return std::size_t(most) + 1;
}

double* run(std::span<const Instruction> program, double* slots, std::span<const double> cell,
            const Lookups& lookups, Random& random, double* stack) {
  double* top = stack;  // one past the last value
  const auto unary = [&](auto f) { top[-1] = f(top[-1]); };
  const auto binary = [&](auto f) { --top, top[-1] = f(top[-1], top[0]); };
  const Instruction* const end = program.data() + program.size();
  for (const Instruction* i = program.data(); i < end; ++i) {
    switch (i->op) {
      case Op::constant:
        *top++ = i->value;
        break;
      case Op::slot:
        *top++ = slots[i->index];
        break;
      case Op::cell:
        *top++ = cell[std::size_t(i->index)];
        break;
      case Op::cell_at:
        unary([&](double key) {
          return key >= 0. && key < total_keys && key == std::floor(key)
                     ? cell[std::size_t(i->index) + std::size_t(key)]
                     : nonsense;
        });
        break;
      case Op::store:
        slots[i->index] = *--top;
        break;
      case Op::jump:
        i += i->index;
        break;
      case Op::jump_if_zero:
        if (std::isnan(*--top))
          throw Error("the condition of an if() is no number; keep its expressions in their domain");
        if (*top == 0.) i += i->index;
        break;
      case Op::table:
        unary([&](double x) { return lookups.tables[std::size_t(i->index)].lookup(x); });
        break;
      case Op::row: {
        const Sample& sample = lookups.samples[std::size_t(i->index)];
        top -= sample.conditions.size();
        *top = double(sample.draw({top, sample.conditions.size()}, random));
        ++top;
        break;
      }
      case Op::outcome:
        unary([&](double row) {
          const Sample& sample = lookups.samples[std::size_t(i->index)];
          return row >= 0. && row < double(sample.rows())
                     ? sample.outcome(std::size_t(row), std::size_t(i->value))
                     : nonsense;
        });
        break;
      case Op::add:
        binary([](double a, double b) { return a + b; });
        break;
      case Op::subtract:
        binary([](double a, double b) { return a - b; });
        break;
      case Op::multiply:
        binary([](double a, double b) { return a * b; });
        break;
      case Op::divide:
        binary([](double a, double b) { return a / b; });
        break;
      case Op::power:
        binary([](double a, double b) { return b == 2. ? a * a : std::pow(a, b); });
        break;
      case Op::modulo:
        binary(modulo);
        break;
      case Op::negate:
        unary([](double a) { return -a; });
        break;
      case Op::less:
        binary([](double a, double b) { return double(a < b); });
        break;
      case Op::less_equal:
        binary([](double a, double b) { return double(a <= b); });
        break;
      case Op::greater:
        binary([](double a, double b) { return double(a > b); });
        break;
      case Op::greater_equal:
        binary([](double a, double b) { return double(a >= b); });
        break;
      case Op::equal:
        binary([](double a, double b) { return double(a == b); });
        break;
      case Op::not_equal:
        binary([](double a, double b) { return double(a != b); });
        break;
      case Op::logical_and:
        binary([](double a, double b) { return both(truth(a), truth(b)); });
        break;
      case Op::logical_or:
        binary([](double a, double b) { return 1. - both(1. - truth(a), 1. - truth(b)); });
        break;
      case Op::logical_not:
        unary([](double a) { return 1. - truth(a); });
        break;
      case Op::sin:
        unary([](double a) { return std::sin(a * degree); });
        break;
      case Op::cos:
        unary([](double a) { return std::cos(a * degree); });
        break;
      case Op::tan:
        unary([](double a) { return std::tan(a * degree); });
        break;
      case Op::asin:
        unary([](double a) { return std::asin(a) / degree; });
        break;
      case Op::acos:
        unary([](double a) { return std::acos(a) / degree; });
        break;
      case Op::atan:
        unary([](double a) { return std::atan(a) / degree; });
        break;
      case Op::atan2:
        binary([](double a, double b) { return std::atan2(a, b) / degree; });
        break;
      case Op::exp:
        unary([](double a) { return std::exp(a); });
        break;
      case Op::log:
        unary([](double a) { return std::log(a); });
        break;
      case Op::sqrt:
        unary([](double a) { return std::sqrt(a); });
        break;
      case Op::abs:
        unary([](double a) { return std::abs(a); });
        break;
      case Op::floor:
        unary([](double a) { return std::floor(a); });
        break;
      case Op::ceil:
        unary([](double a) { return std::ceil(a); });
        break;
      case Op::round:
        unary([](double a) { return std::round(a); });
        break;
      case Op::sign:
        unary([](double a) { return std::isnan(a) ? a : double(a > 0.) - double(a < 0.); });
        break;
      case Op::min:
        binary([](double a, double b) { return b < a || std::isnan(b) ? b : a; });
        break;
      case Op::max:
        binary([](double a, double b) { return b > a || std::isnan(b) ? b : a; });
        break;
      case Op::uniform:
        binary([&](double a, double b) { return random.uniform(a, b); });
        break;
      case Op::normal:
        binary([&](double a, double b) { return normal(random, a, b); });
        break;
      case Op::lognormal:
        binary([&](double a, double b) { return std::exp(normal(random, a, b)); });
        break;
      case Op::gamma:
        binary([&](double a, double b) { return gamma(random, a, b); });
        break;
      case Op::exponential:
        unary([&](double a) { return exponential(random, a); });
        break;
      case Op::weibull:
        binary([&](double a, double b) { return weibull(random, a, b); });
        break;
      case Op::vonmises:
        binary([&](double a, double b) { return von_mises(random, a, b); });
        break;
      case Op::poisson:
        unary([&](double a) { return poisson(random, a); });
        break;
      case Op::chance:
        unary([&](double a) { return chance(random, a); });
        break;
      case Op::dealt:
        unary([&](double a) { return dealt(random, a); });
        break;
      case Op::truncnormal:
        top -= 3;
        top[-1] = truncated_normal(random, top[-1], top[0], top[1], top[2]);
        break;
    }
  }
  return top;
}

}  // namespace forest::lsystem
