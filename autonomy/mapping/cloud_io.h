#pragma once

#include <filesystem>
#include <span>

#include "math/types.h"

namespace arex {

/// Writes points as a binary PCD of x, y, z (float, m). The file appears whole or not at all: who
/// is killed meanwhile leaves the one before. @throws DiskError.
void write_pcd(const std::filesystem::path& file, std::span<const Vec3f> points);

}  // namespace arex
