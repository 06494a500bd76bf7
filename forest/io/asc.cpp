// SPDX-License-Identifier: Apache-2.0
#include "forest/io/asc.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/byte_order_mark.h"
#include "forest/core/error.h"
#include "forest/io/asc_own.h"
#include "forest/io/asc_text.h"
#include "forest/io/asc_words.h"
#include "forest/io/numbers.h"
#include "forest/io/own_file.h"
#include "forest/io/placed_words.h"
#include "forest/io/plain_text.h"
#include "forest/io/swc_rows.h"
#include "forest/io/traced_branch.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

constexpr std::string_view several_cells =
    "nothing, if they are outlines of one soma; split the file if it holds several cells";

constexpr std::string_view keep_original = "nothing, but keep the original if they matter";

constexpr std::array<Oddity, static_cast<std::size_t>(AscOddity::count)> table{{
    {"byte-order-mark", false, "the mark is skipped"},
    {"padding", false, "what stands behind the text is skipped"},
    {"thumbnail", false, "the picture is skipped", {}, true},
    {"several-outlines", false, "read as one soma, a stack of outlines", several_cells},
    {"outline-by-name", true, "read as an outline of the soma"},
    {"small-outline", true, "read as a sphere of its size", "trace the outline with three points or more"},
    {"empty-outline", true, "skipped"},
    {"no-type", true, "read as a neurite of undefined kind",
     "write (Axon), (Dendrite) or (Apical) before its first point"},
    {"type-in-branch", true, "this branch and those on it are of that kind",
     "nothing, if the types are right"},
    {"no-diameter", true, "read with the diameter of the point before", "measure it where thickness matters"},
    {"negative-diameter", true, "read as unknown, so as that of the point before",
     "measure it where thickness matters"},
    {"unknown-diameter", true, "read as that of the point before", "measure it where thickness matters"},
    {"unknown-place", true, "read as that of the point before",
     "look it up in the tracing, or remove the point"},
    {"extra-numbers", false, "all but the first four are skipped", {}, true},
    {"empty-tree", true, "skipped"},
    {"tree-begins-with-split", true, "its branches are read as trees of their own",
     "give it the point they leave from"},
    {"branch-without-points", true, "what hangs on it hangs on the branch point before"},
    {"only-branch-point", true, "left out; what hangs on it hangs on the branch point itself"},
    {"empty-branch", true, "skipped"},
    {"single-daughter", true, "kept as a section of its own", "nothing, if a section begins there"},
    {"second-split", true, "its branches leave from the same branch point"},
    {"unknown-word", true, "kept like the words for the end of a branch", "nothing, if it is meant so"},
    {"text-in-tree", true, "skipped", "keep it outside of the tree", true},
    {"trailing-text", false, "skipped", "see whether trees are missing", true},
    {"spine-without-place", true, "skipped", "put it behind the point it sits on", true},
    {"spine-before-points", true, "put on that point", "put it behind the point it sits on"},
    {"stray-bracket", true, "skipped"},
    {"comments-not-kept", false, "they are skipped", keep_original, true},
    {"properties-not-kept", false, "they are skipped", keep_original, true},
}};

constexpr std::array<std::string_view, 7> leaf_words{"Normal",    "High",   "Low",     "Incomplete",
                                                     "Generated", "Origin", "Midpoint"};

std::optional<SectionKind> type_of(std::string_view word) {
  if (same_word(word, "axon")) return SectionKind::axon;
  if (same_word(word, "dendrite")) return SectionKind::basal;
  if (same_word(word, "apical") || same_word(word, "apicaldendrite")) return SectionKind::apical;
  return std::nullopt;
}

/// What is skipped, counted. Places rather than times, since the reader goes over some twice.
class Lost {
 public:
  void add(std::size_t line, std::string_view text) {
    if (text.empty() || (count_ && text.data() <= last_)) return;
    if (count_++ == 0) line_ = line, first_ = shown(text);
    last_ = text.data();
  }
  void tell(OddityList<AscOddity>& oddities, AscOddity code, std::string_view what) const {
    if (count_)
      oddities.add(code, line_, [&] { return fmt::format("{} {}, the first \"{}\"", count_, what, first_); });
  }

 private:
  std::size_t count_ = 0, line_ = 0;
  const char* last_ = nullptr;
  std::string first_;
};

class Reader final : private AscText {
 public:
  Reader(std::string_view bytes, const std::string& name) : Reader(plain_text(bytes, name), name) {}

  void read() {
    for (;;) {
      inside_ = false;
      const char c = next();
      if (c == '(') {
        inside_ = true;
        block();
      } else if (c == ')') {
        oddities_.add(AscOddity::stray_bracket, line_, "a bracket closes that was not opened");
        ++p_;
      } else if (p_ == end_) {
        return;
      } else if (!holds_nothing() && std::find(p_, end_, '(') == end_) {
        oddities_.add(AscOddity::trailing_text, line_, "words follow the last bracket");
        return;
      } else {
        throw InputError(
            name_, line_,
            fmt::format("\"{}\" stands outside of all brackets; in Neurolucida ASC everything is in "
                        "brackets, and comments begin with ;",
                        shown(word())));
      }
    }
  }

  bool holds_nothing() const { return sections_.size() == 0 && soma_.points.empty(); }
  bool may_hold_nothing() const { return without_points_; }
  const Annotations& annotations() const { return annotations_; }

  ReadResult result() {
    set_soma();
    sections_.add_spines();
    lost_comments_.tell(oddities_, AscOddity::comments_not_kept,
                        "comments inside of brackets or behind them");
    lost_properties_.tell(oddities_, AscOddity::properties_not_kept,
                          "properties (names, colours and others) of outlines, branches and spines");
    for (auto& [key, value] : annotations_) builder_.annotate(std::move(key), std::move(value));
    return {builder_.build(), oddities_.take()};
  }

 private:
  Reader(const PlainText& plain, const std::string& name)
      : AscText(plain.text, name, table), sections_(builder_, text_.find('<') != text_.npos) {
    if (plain.byte_order_mark)
      oddities_.add(AscOddity::byte_order_mark, 1, "the file begins with a byte order mark");
    if (plain.padding) oddities_.add(AscOddity::padding, 0, "zero bytes or Ctrl-Z stand at the end");
  }

  // Comments -----------------------------------------------------------------------------------------------

  void comment(std::string_view text) override {
    const std::string_view said = asc_comment(text);
    if (inside_ && !to_the_letter_) return lose_comment(said);
    const char* before = text.data();
    while (before > text_.data() && is_blank(before[-1])) --before;
    if (inside_) {
      if (said.starts_with(asc_own_prefix) &&
          !said_.take(said, std::max(own_.points.size(), soma_.points.size())))
        throw InputError(name_, line_,
                         fmt::format("the comment {} does not hold the numbers it should; remove the line",
                                     shown(said.substr(0, said.find(' ')))));
    } else if (const OwnFile own = own_file(said, asc_marker); line_ == 1 && own.ours) {
      to_the_letter_ = true, without_points_ = own.without_points;
    } else if (const bool whole_line = before == text_.data() || is_line_end(before[-1]); !whole_line) {
      lose_comment(said);
    } else if (!said.empty()) {
      const auto [key, value] = swc_comment(said);
      annotations_.emplace_back(key, value);
    }
  }

  /// "3, R-1-2", "Root" and "End of split" number what the brackets say.
  void lose_comment(std::string_view text) {
    const bool numbering = text.find_first_not_of("0123456789 ,.-[]R") == text.npos;
    if (!numbering && text != "Root" && !text.starts_with("End of ")) lost_comments_.add(line_, text);
  }

  // Blocks -------------------------------------------------------------------------------------------------

  static bool is_marker(const Block& block) { return block.points > 0 && block.word != "Color"; }

  /// A block that is neither tree nor outline.
  void keep_block(std::string_view key, Block block) {
    annotations_.emplace_back(key, std::move(block.text));
  }

  /// A block of the file.
  void block() {
    const char* const begin = p_;
    const std::size_t begin_line = line_;
    has_last_ = false, last_ = {};
    branch_ = {};
    branch_.line = line_;
    said_.soma.clear();
    said_.section.reset();
    std::optional<SectionKind> type;
    std::optional<std::string_view> title;
    bool cell_body = false;
    std::string properties;
    std::vector<std::pair<std::size_t, std::string_view>> lost_of_outline;
    ++p_;
    if (const char c = next(); is_letter(c)) {
      const std::string_view word = this->word();
      type = type_of(word);
      cell_body = names_soma(word);
      if (!type && !cell_body) {
        back_to(begin, begin_line);
        return word_block();
      }
      p_ += word.size();
    }
    for (;;) {  // what is said before the first point
      const char c = next();
      const char* const at = p_;
      const std::size_t at_line = line_;
      if (c == '"') {
        const std::string_view string = quoted();
        if (!title) title = string;
        if (!names_soma(string)) lost_of_outline.emplace_back(at_line, string);
        properties += fmt::format("{}\"{}\"", properties.empty() ? "" : " ", string);
        continue;
      }
      if (c != '(') break;
      ++p_;
      const bool property = is_letter(next());
      back_to(at, at_line);
      if (!property) break;
      Block block = skip_block();
      if (const auto kind = type_of(block.word)) {
        type = kind;
      } else if (names_soma(block.word) && !block.more) {
        cell_body = true;
      } else if (is_marker(block)) {
        keep_block("marker", std::move(block));
      } else {
        refuse_broken_point(block, at_line);
        if (!properties.empty()) properties += ' ';
        properties += block.text;
        if (block.more) lost_of_outline.emplace_back(at_line, std::string_view(at, p_));
      }
    }
    if (p_ == end_) unfinished("a block", begin_line);
    const auto soma = [&] {
      for (const auto& [line, text] : lost_of_outline) lost_properties_.add(line, text);
      outline(begin_line);
    };
    if (cell_body) return soma();
    if (type) return tree(*type, properties);
    const char* const content = p_;
    const std::size_t content_line = line_;
    back_to(begin, begin_line);
    Block whole = skip_block();
    if (title && names_soma(*title) && whole.points > 0) {
      oddities_.add(AscOddity::outline_by_name, begin_line, [&] {
        return fmt::format("an outline is called \"{}\" but has no (CellBody)", shown(*title));
      });
      back_to(content, content_line);
      soma();
    } else if (title) {
      keep_block(whole.points > 0 ? "contour" : "text", std::move(whole));
    } else if (whole.quotes || (whole.points < 2 && !whole.splits)) {
      if (whole.more)
        keep_block("text", std::move(whole));
      else
        oddities_.add(AscOddity::empty_tree, begin_line, "brackets with nothing in them");
    } else {
      oddities_.add(AscOddity::no_type, begin_line, "a tree has no type");
      back_to(content, content_line);
      tree(SectionKind::undefined, properties);
    }
  }

  /// A block of the file that begins with a word: (Sections …), a marker.
  void word_block() {
    const std::size_t line = line_;
    Block block = skip_block();
    if (same_word(block.word, "thumbnail"))
      oddities_.add(AscOddity::thumbnail, line, "the file holds a small picture of the cell");
    else if (block.more)
      keep_block(is_marker(block) ? "marker" : "asc", std::move(block));
  }

  // The soma -----------------------------------------------------------------------------------------------

  void outline(std::size_t begin) {
    const std::size_t first = soma_.points.size();
    for (;;) {
      const char c = next();
      if (c == ')') break;
      if (p_ == end_) unfinished("an outline", begin);
      if (c == '"') {
        lost_properties_.add(line_, quoted());
        continue;
      }
      if (c != '(') unexpected("an outline");
      const char* const at = p_;
      const std::size_t at_line = line_;
      ++p_;
      const char inner = next();
      if (begins_number(inner)) {
        last_ = point();
        has_last_ = true;
        soma_.points.push_back(last_);
      } else if (p_ == end_) {
        unfinished("an outline", begin);
      } else if (is_letter(inner)) {
        back_to(at, at_line);
        Block block = skip_block();
        refuse_broken_point(block, at_line);
        if (is_marker(block))
          keep_block("marker", std::move(block));
        else if (block.more)
          lost_properties_.add(at_line, {at, p_});
      } else {
        unexpected("an outline");
      }
    }
    ++p_;
    if (!said_.soma.empty()) {
      if (!soma_.contour_starts.empty() || own_.kind != SomaKind::none)
        throw InputError(name_, begin, "the soma is said twice; remove one of its outlines");
      auto said = said_.whole_soma();
      if (!said) throw InputError(name_, begin, "the comments FOREST_… of the soma are no soma; remove them");
      own_ = *std::move(said);
      return;
    }
    if (soma_.points.size() == first) {
      oddities_.add(AscOddity::empty_outline, begin, "an outline has no points");
      return;
    }
    if (first > 0) oddities_.add(AscOddity::several_outlines, begin, "the soma has several outlines");
    if (soma_.contour_starts.empty()) soma_line_ = begin;
    soma_.contour_starts.push_back(static_cast<std::uint32_t>(first));
  }

  void set_soma() {
    if (own_.kind != SomaKind::none) {
      if (!soma_.points.empty() && !soma_.contour_starts.empty())
        throw InputError(name_, soma_line_, "the soma is said twice; remove one of its outlines");
      return builder_.set_soma(std::move(own_));
    }
    if (soma_.points.empty()) return;
    if (soma_.points.size() < 3)
      oddities_.add(AscOddity::small_outline, soma_line_, [&] {
        return fmt::format("the outline of the soma has {} points", soma_.points.size());
      });
    builder_.set_soma(soma_of_outlines(std::move(soma_)));
  }

  // Trees --------------------------------------------------------------------------------------------------

  struct Branch : TracedBranch {
    bool split = false;
    std::string_view leaf;
    std::size_t line = 0;
  };
  struct Split {
    Branch branch;  // that splits
    std::size_t line = 0;
    std::size_t daughters = 0;
  };
  void tree(SectionKind kind, const std::string& properties) {
    branch_.kind = kind, branch_.tag = std::int32_t(kind);
    const std::size_t begin = branch_.line;
    properties_ = properties;
    points_.clear();
    for (;;) {
      const char c = next();
      if (c == '(') {
        const char* const at = p_;
        const std::size_t at_line = line_;
        ++p_;
        const char inner = next();
        if (begins_number(inner)) [[likely]] {
          if (branch_.over) refuse_late_point();
          if (said_.section) [[unlikely]]
            take_what_is_said();
          last_ = point();
          has_last_ = true;
          points_.push_back(last_);
        } else if (is_letter(inner) || inner == '"') {
          back_to(at, at_line);
          inner_block();
        } else {
          begin_split(at_line);
        }
      } else if (c == '|') {
        if (splits_.empty())
          throw InputError(name_, line_, "a | stands outside of a split; put the branches into brackets");
        ++p_;
        end_branch();
        begin_branch();
      } else if (c == ')') {
        ++p_;
        end_branch();
        if (splits_.empty()) return;
        Split split = std::move(splits_.back());
        splits_.pop_back();
        if (split.daughters == 1 && !to_the_letter_)
          oddities_.add(AscOddity::single_daughter, split.line, "a split has a single branch");
        branch_ = std::move(split.branch);
      } else if (c == '<') {
        spine();
      } else if (c == '"') {
        oddities_.add(AscOddity::text_in_tree, line_, "a text stands in a tree");
        quoted();
      } else if (p_ == end_) {
        splits_.empty()
            ? unfinished("a tree", begin)
            : unfinished(fmt::format("a split (opened on line {}) of a tree", splits_.back().line), begin);
      } else if (is_letter(c)) {
        leaf_word();
      } else {
        unexpected("a tree");
      }
    }
  }

  [[noreturn]] void refuse_late_point() const {
    throw InputError(name_, line_,
                     branch_.split
                         ? std::string("a point follows the split that ends its branch; give it a branch of "
                                       "its own")
                         : fmt::format("a point follows \"{}\", which ends its branch; remove the word, or "
                                       "separate the branches by |",
                                       shown(branch_.leaf)));
  }

  void begin_split(std::size_t line) {
    if (splits_.empty() && !branch_.node.valid() && points_.empty() && !branch_.own)
      oddities_.add(AscOddity::tree_begins_with_split, line, "a tree begins with a split");
    else if (points_.empty() && !branch_.over)
      oddities_.add(AscOddity::branch_without_points, line, "a branch splits before its first point");
    close_points();
    if (branch_.split) oddities_.add(AscOddity::second_split, line, "a branch splits twice");
    branch_.split = true;
    splits_.push_back({branch_, line, 0});
    begin_branch();
  }

  void begin_branch() {
    const Branch& parent = splits_.back().branch;
    branch_ = {};
    branch_.node = parent.node;
    branch_.kind = parent.kind, branch_.tag = parent.tag;
    branch_.line = line_;
    if (parent.node.valid()) last_ = sections_.end(parent.node);
  }

  void end_branch() {
    close_points();
    const bool something = branch_.own || branch_.split;
    if (!something && !branch_.excused)
      splits_.empty() ? oddities_.add(AscOddity::empty_tree, branch_.line, "a tree has no points")
                      : oddities_.add(AscOddity::empty_branch, branch_.line, "a branch has no points");
    if (!splits_.empty()) splits_.back().daughters += something;
    if (!branch_.leaf.empty() && branch_.node.valid() && branch_.leaf != leaf_words[0])
      annotations_.emplace_back("leaf",
                                fmt::format("{} {}", branch_.leaf, place_text(sections_.end(branch_.node))));
  }

  /// The branch has no more points: they become a section.
  void close_points() {
    if (splits_.empty() && !properties_.empty() && !points_.empty())
      annotations_.emplace_back("tree", fmt::format("{} {}", place_text(points_[0]), properties_));
    const auto closed = sections_.close(branch_, points_, seats_);
    if (closed.only_branch_point)
      oddities_.add(AscOddity::only_branch_point, branch_.line,
                    "a branch holds only the point it leaves from");
    for (std::size_t i = 0; i < closed.early_spines; ++i)
      oddities_.add(AscOddity::spine_before_points, branch_.line,
                    "a spine stands before the first point of its tree");
    for (std::size_t i = 0; i < closed.lost_spines; ++i)
      oddities_.add(AscOddity::spine_without_place, branch_.line,
                    "a spine stands where its tree has no point");
  }

  void spine() {
    const std::size_t begin = line_;
    ++p_;
    said_.spine.reset();
    bool placed = false;
    std::size_t depth = 0;  // some programs put brackets around what is in the spine
    SpineSeat seat{.points = points_.size(), .spine = {}, .head = Vec3::Zero(), .said = false};
    for (;;) {
      const char c = next();
      if (c == '>') break;
      if (p_ == end_) unfinished("a spine", begin);
      if (c == '"') {
        lost_properties_.add(line_, quoted());
        continue;
      }
      if (c == ')' && depth > 0) {
        --depth, ++p_;
        continue;
      }
      if (c != '(') unexpected("a spine");
      const char* const at = p_;
      const std::size_t at_line = line_;
      ++p_;
      const char inner = next();
      if (begins_number(inner)) {
        const Point head = point();
        seat.head = head.position(), seat.spine.head_diameter = 2.f * head.radius;
        placed = true;
      } else if (is_letter(inner)) {
        back_to(at, at_line);
        const Block block = skip_block();
        refuse_broken_point(block, at_line);
        if (same_word(block.word, "class")) seat.spine.shape = spine_shape(block.quoted);
        if (block.more && (!same_word(block.word, "class") || seat.spine.shape == SpineShape::unknown))
          lost_properties_.add(at_line, {at, p_});
      } else if (p_ == end_) {
        unfinished("a spine", begin);
      } else if (inner == '(') {
        ++depth;
      } else {
        unexpected("a spine");
      }
    }
    ++p_;
    if (said_.spine) seat.spine = *std::exchange(said_.spine, std::nullopt), seat.said = true;
    if (!placed && !seat.said)
      oddities_.add(AscOddity::spine_without_place, begin, "a spine has no point");
    else
      seats_.push_back(seat);
  }

  /// A block among the points of a tree: a property, a marker, a type.
  void inner_block() {
    const char* const at = p_;
    const std::size_t line = line_;
    Block block = skip_block();
    if (const auto kind = type_of(block.word); kind && !block.more) {
      if (*kind == branch_.kind) return;
      if (branch_.over || !points_.empty())
        throw InputError(
            name_, line,
            fmt::format("({}) stands among the points of a branch; put it before the first one", block.word));
      oddities_.add(AscOddity::type_in_branch, line,
                    [&] { return fmt::format("a branch is of type {}", block.word); });
      branch_.kind = *kind, branch_.tag = std::int32_t(*kind);
      return;
    }
    refuse_broken_point(block, line);
    if (is_marker(block))
      keep_block(block.word.empty() ? "contour" : "marker", std::move(block));
    else if (block.word.empty())
      oddities_.add(AscOddity::text_in_tree, line, "a text stands in a tree");
    else if (block.more)
      lost_properties_.add(line, {at, p_});
  }

  void leaf_word() {
    const std::string_view leaf = word();
    if (!std::ranges::all_of(leaf, [](char c) { return is_letter(c); })) unexpected("a tree");
    if (std::ranges::find(leaf_words, leaf) == leaf_words.end())
      oddities_.add(AscOddity::unknown_word, line_,
                    [&] { return fmt::format("\"{}\" ends a branch", shown(leaf)); });
    p_ += leaf.size();
    close_points();
    branch_.leaf = leaf;
  }

  /// At the first point of the branch that a comment of ours is about.
  void take_what_is_said() {
    if (!points_.empty())
      throw InputError(
          name_, line_,
          fmt::format("the comment {} stands among the points of a branch; remove it", asc_section_key));
    branch_.kind = said_.section->kind, branch_.tag = said_.section->tag;
    branch_.soma_point = said_.section->soma_point;
    said_.section.reset();
  }

  bool inside_ = false, to_the_letter_ = false, without_points_ = false;

  MorphologyBuilder builder_;
  TracedSections sections_;
  Annotations annotations_;
  Soma soma_, own_;
  std::size_t soma_line_ = 0;
  AscOwn said_;

  Lost lost_comments_, lost_properties_;
  Branch branch_;
  std::vector<Split> splits_;
  std::vector<Point> points_;  // of the branch
  std::string properties_;     // of the tree
  std::vector<SpineSeat> seats_;
};

}  // namespace

bool asc_reads_as_annotation(std::string_view text, std::string_view key, std::string_view value) {
  const std::string name;
  try {
    Reader reader(text, name);
    reader.read();
    return reader.annotations() == Annotations{{std::string(key), std::string(value)}};
  } catch (const InputError&) {
    return false;
  }
}

bool recognises_asc(std::string_view bytes) {
  std::size_t at = bytes.size() - without_byte_order_mark(bytes).size();
  const auto skip = [&] {
    while (at < bytes.size()) {
      if (bytes[at] == ';')
        at = std::min(bytes.find_first_of("\r\n", at), bytes.size());
      else if (is_blank(bytes[at]) || is_line_end(bytes[at]))
        ++at;
      else
        break;
    }
  };
  skip();
  if (at == bytes.size() || bytes[at] != '(') return false;
  ++at;
  skip();
  return at < bytes.size() && (is_letter(bytes[at]) || bytes[at] == '"' || bytes[at] == '(');
}

ReadResult read_asc(std::string_view bytes, const std::string& name) {
  Reader reader(bytes, name);
  reader.read();
  if (reader.holds_nothing() && !reader.may_hold_nothing()) {
    const std::string sentence =
        "holds neither a tree nor a cell body; a tree is ((Axon) (x y z diameter) …)";
    if (reader.annotations().empty()) throw InputError(name, 0, sentence);
    throw NotANeuron(name, 0, sentence);  // outlines of layers, markers
  }
  return reader.result();
}

std::span<const Oddity> asc_oddities() { return table; }

}  // namespace forest::io
