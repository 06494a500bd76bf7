// SPDX-License-Identifier: Apache-2.0
// Whether all that is stored is what its points say.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "forest/core/parallel.h"
#include "forest/repository/impl.h"
#include "forest/repository/names.h"
#include "forest/repository/stored_metrics.h"

namespace forest::repository {

std::vector<std::string> Repository::Impl::findings(const Repository& repository,
                                                    std::span<const NeuronRow> neurons) const {
  std::vector<std::string> findings(neurons.size());
  std::vector<std::optional<Morphology>> whole(neurons.size());
  for (std::size_t i = 0; i < neurons.size(); ++i) try {
      whole[i] = repository.morphology(neurons[i].id);
    } catch (const Error& error) {
      findings[i] = error.what();
    }
  std::vector<Rows> expected(neurons.size());
  parallel_for(neurons.size(), 1, [&](std::size_t i) {
    if (whole[i]) expected[i] = rows_of(*whole[i]);
  });
  const auto known = read([&] {
    return ask<int>(fmt::format("select count(*) from metrics where id < {}", first_further_number))
        .value_or(0);
  });
  Statements statements(*database);
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    if (!whole[i]) continue;
    Rows& rows = statements.rows = std::move(expected[i]);
    for (; !rows.metric.empty() && rows.metric.back() > known;
         rows.metric.pop_back())  // this program knows more
      rows.metric_value.pop_back();
    statements.id = number_of(neurons[i].id);
    if (const std::string why = read([&] { return statements.deviation(*database, *whole[i]); });
        !why.empty())
      findings[i] = fmt::format(
          "{}: neuron {} (id {}) is not what its points say ({}); take it out with 'brainforest remove' and "
          "import or "
          "grow it again",
          place, shown(neurons[i].name), statements.id, why);
  }
  std::erase(findings, "");
  return findings;
}

std::vector<std::string> Repository::check(Progress& progress) const {
  std::vector<std::string> findings;
  try {
    impl_->guarded([&] {
      for (const std::string& finding : impl_->database->examine_structure())
        findings.push_back(fmt::format("{}: {}", impl_->place, finding));
    });
    for (const ModelRow& model : models())
      if (hash_of(model.text) != model.hash)
        findings.push_back(fmt::format(
            "{}: the text of model {} (version {}) is damaged; restore the repository from a backup",
            impl_->place, shown(model.name), model.version));
    const auto rows = neurons();
    progress.begin("checking", rows.size());
    constexpr std::size_t together = 64;  // on all cores
    for (std::size_t first = 0; first < rows.size(); first += together) {
      const auto some = std::span(rows).subspan(first, std::min(together, rows.size() - first));
      for (std::string& finding : impl_->findings(*this, some)) findings.push_back(std::move(finding));
      progress.advance(some.size());
    }
    progress.end();
  } catch (const Error& error) {
    findings.emplace_back(error.what());
  }
  return findings;
}

}  // namespace forest::repository
