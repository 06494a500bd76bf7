// SPDX-License-Identifier: Apache-2.0
// The writers behind the table in model.h. What each file says and leaves out: docs/formats/models.md.
#pragma once

#include <string>

#include "forest/io/model.h"

namespace forest::io {

std::string write_gltf(const Model& model);
std::string write_obj(const Model& model);
std::string write_ply(const Model& model);
std::string write_stl(const Model& model);
std::string write_vrml(const Model& model);
std::string write_x3d(const Model& model);

}  // namespace forest::io
