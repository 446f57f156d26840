#pragma once

#include <filesystem>

/// What the host gives to this process.
namespace arex::app {

/// Cores that it may run on.
int cores();

/// The file itself if there is one, or else the scenario, sweep or recipe of that name which was
/// installed with this program; the file again if there is none.
std::filesystem::path resolve_input_file(const std::filesystem::path& file);

/// Opens /dev/null where standard input, output or error are closed: otherwise the next file to be
/// opened gets their number, and what is meant for people lands in it.
void open_standard_streams();

/// @throws DiskError if something printed so far did not get out.
void flush_standard_output();

}  // namespace arex::app
