// SPDX-License-Identifier: Apache-2.0
#include "forest/io/acc.h"

#include <vector>

#include <fmt/format.h>

#include "forest/io/comments.h"
#include "forest/io/numbers.h"
#include "forest/io/soma_place.h"
#include "forest/io/swc_rows.h"

namespace forest::io {
namespace {

class Writer {
 public:
  explicit Writer(const Morphology& m) : m_(m), soma_place_(m) {}

  std::string write() {
    text_ = comment_lines(m_.annotations(), ";");
    text_ += "(arbor-component\n  (meta-data (version \"0.1-dev\"))\n  (morphology";
    soma();
    const std::int64_t first = branches_;
    for (std::size_t s = 0; s < m_.sections().size(); ++s) {
      const Section& section = m_.sections()[s];
      const std::int32_t place = section.parent.valid() ? -1 : soma_place_(SectionId(s));
      branch(section.parent.valid() ? first + section.parent.value()
             : place >= 0           ? soma_branches_[std::size_t(place)]
                                    : -1,
             m_.points(SectionId(s)), swc_type(section));
    }
    return text_ + "))\n";
  }

 private:
  void soma() {
    const Soma& soma = m_.soma();
    if (soma.kind == SomaKind::sphere) {
      const auto [low, middle, high] = cylinder_of(soma.points[0]);
      branch(-1, std::vector{low, middle}, swc_soma_type);
      branch(0, std::vector{middle, high}, swc_soma_type);
      soma_branches_ = {0};
    } else if (soma.kind == SomaKind::cylinders) {
      soma_branches_ = {-1};  // the first point begins the cell
      for (std::size_t i = 1; i < soma.points.size(); ++i) {
        const auto from = std::size_t(soma.parents[i]);
        branch(soma_branches_[from], std::vector{soma.points[from], soma.points[i]}, swc_soma_type);
        soma_branches_.push_back(branches_ - 1);
      }
    }
  }

  void branch(std::int64_t parent, std::span<const Point> points, std::int32_t tag) {
    text_ += fmt::format("\n    (branch {} {}", branches_++, parent);
    for (std::size_t i = 1; i < points.size(); ++i) {
      text_ += fmt::format("\n      (segment {} ", segments_++);
      point(points[i - 1]);
      text_ += ' ';
      point(points[i]);
      text_ += fmt::format(" {})", tag);
    }
    text_ += ')';
  }

  void point(const Point& p) {
    text_ += "(point";
    for (const float number : {p.x, p.y, p.z, p.radius}) {
      const std::size_t begin = text_.size();
      text_ += ' ';
      append_number(text_, number);
      if (text_.find('.', begin) == text_.npos) text_ += ".0";  // a real number of Arbor's grammar
    }
    text_ += ')';
  }

  const Morphology& m_;
  SomaPlaces soma_place_;
  std::string text_;
  std::vector<std::int64_t> soma_branches_;  // that end at a soma point
  std::int64_t branches_ = 0, segments_ = 0;
};

}  // namespace

std::string write_acc(const Morphology& morphology) { return Writer(as_kept(morphology, acc_keeps)).write(); }

}  // namespace forest::io
