// SPDX-License-Identifier: Apache-2.0
// The text of the shaders in shaders/, and of frame/layout.h that comes before each of them.
#pragma once

namespace forest::render::shaders {

extern const char* const layout;
extern const char* const common;
extern const char* const dots;
extern const char* const lines;
extern const char* const long_lines;
extern const char* const capsule;  // a part of the two that follow
extern const char* const capsules;
extern const char* const close_ups;
extern const char* const cull;
extern const char* const clear;
extern const char* const tiles;
extern const char* const triangle;  // a part of the two that follow
extern const char* const triangles;
extern const char* const triangle_close_ups;
extern const char* const resolve;
extern const char* const covered;

}  // namespace forest::render::shaders
