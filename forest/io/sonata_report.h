// SPDX-License-Identifier: Apache-2.0
// Reports and spikes of simulations as SONATA (Dai et al. 2020, PLoS Comput Biol 16:e1007696; developer guide, "Simulation
// output"): what BMTK, neurodamus, NEST's and our own examples write. docs/reports/activity.md lists what is read.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "forest/core/progress.h"
#include "forest/reports/report.h"

namespace forest::io {

/// Opens a compartment or soma report; its values stay on the disk until Report::read asks for them. The report keeps the
/// file open.
/// @param population  the only one to read; "" for all, which must then have the same times and units
/// Throws InputError that names what is wrong: a file that is cut off, a missing or wrong array, a mapping that does not
/// fit the values, times that do not fit the rows.
reports::Report read_sonata_report(const std::filesystem::path& file, const std::string& population = "");

/// Writes a report of one population, whole or not at all, a few rows at a time. Its source becomes the attribute "comment"
/// of the root. Throws Error.
void write_sonata_report(const std::filesystem::path& file, const reports::Report& report,
                         Progress& progress = Progress::none());

/// Reads the spikes of all populations, or of one. Throws InputError.
std::vector<reports::Spikes> read_sonata_spikes(const std::filesystem::path& file,
                                                const std::string& population = "");

}  // namespace forest::io
