// SPDX-License-Identifier: Apache-2.0
// Neurolucida XML, the neuromorphological file format of MBF Bioscience (NMF, <mbf version="4.0">; MBFBioscience/nmf-schema).
// Only read. Trees are nested <branch> elements; what they mean is as in ASC (asc.h), and what is kept as annotations
// has ASC's words, so that it can be written there: "leaf", "tree", "marker", "contour".
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "forest/io/format.h"

namespace forest::io {

/// Whether there is an <mbf element.
bool recognises_nmf(std::string_view bytes);

/// Throws InputError when the XML is not well-formed, when a point has no number for a coordinate, or when there is
/// neither a tree nor a soma. Depth is no matter; entities of a document type are not resolved.
ReadResult read_nmf(std::string_view bytes, const std::string& name);

/// Every deviation that is read.
std::span<const Oddity> nmf_oddities();

}  // namespace forest::io
