#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "math/random.h"

/// Sound inputs to be damaged.
namespace arex::test {

/// Files by their path inside a folder.
using Corpus = std::map<std::string, std::string>;

const Corpus& shipped_folder();  ///< scenarios/, the sweeps in it among them
const Corpus& shipped_scenarios();
const Corpus& shipped_sweeps();
const Corpus& recorded_run();
const Corpus& recorded_sweep();

std::vector<std::string> texts_of(const Corpus& corpus);
const std::string& any_name(const Corpus& corpus, RandomStream& random);
void write_files(const Corpus& corpus, const std::filesystem::path& folder);

/// Damages one or two of the files that were written, or removes them.
void damage_files(const Corpus& corpus, const std::filesystem::path& folder, RandomStream& random);

/// Writes a mesh, Gazebo world, octree or cloud and damages it. @return the file
std::filesystem::path write_damaged_world(const std::filesystem::path& folder,
                                          RandomStream& random);
/// The same, and reads it as `arex world` does.
void read_damaged_world(const std::filesystem::path& folder, RandomStream& random);

}  // namespace arex::test
