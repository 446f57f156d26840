#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "pictures/picture.h"

namespace arex::sim {

/// Where a program of this name stands on PATH; empty if nowhere.
std::filesystem::path find_program(const std::string& name);

/// Takes the frames of a film one after the other.
class FilmWriter {
 public:
  virtual ~FilmWriter() = default;
  /// @throws std::runtime_error when the frame cannot be kept.
  virtual void add(const Picture& frame) = 0;
  /// After the last frame. @return what was written.
  virtual std::filesystem::path finish() = 0;
};

/// An H.264 film by ffmpeg. The file appears whole or not at all.
/// @pre width and height even.
std::unique_ptr<FilmWriter> film_by_ffmpeg(const std::filesystem::path& ffmpeg,
                                           const std::filesystem::path& file, int width, int height,
                                           int fps);

/// PNG files 000001.png, ... in a folder, which is emptied of such files first.
std::unique_ptr<FilmWriter> film_as_frames(const std::filesystem::path& folder);

}  // namespace arex::sim
