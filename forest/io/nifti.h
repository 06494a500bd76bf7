// SPDX-License-Identifier: Apache-2.0
// NIfTI, the volume format of neuroimaging: version 1 (Cox, Ashburner, Breman et al. 2004) and 2 (2011), one file (.nii),
// packed by gzip or not.
//
//   348 bytes (version 2: 540)   sizes, type, scale, and three ways from voxels to mm, of which we take the affine one (sform)
//                                when it is there, else the quaternion (qform), else the voxel sizes
//   from vox_offset on           the voxels, the first axis fastest
//
// Of the order of bytes tells sizeof_hdr. We read it ourselves and not by nifticlib: that trusts the sizes of the header.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "forest/cortex/volume.h"

namespace forest::io {

/// Whether the bytes, unpacked or not, may be such a file.
bool may_be_nifti(std::string_view bytes);

struct NiftiVolume {
  cortex::Volume volume;
  std::vector<std::string> oddities;  // sentences, without the file's name
};

/// In µm, axes to the right, to the front and upwards (a volume whose axes run otherwise is turned so). Of several volumes
/// the first. Throws InputError: another type, sizes that are not there, axes that are oblique to those of space by more than
/// a fifth of a voxel over the volume (quaternions of single precision are off by some hundredths), pairs of files (.hdr and .img).
NiftiVolume read_nifti(std::string_view bytes, const std::string& name);

}  // namespace forest::io
