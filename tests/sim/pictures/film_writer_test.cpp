#include "pictures/film_writer.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "support/temporary_folder.h"

namespace arex::sim {
namespace {

using test::read_text;
using test::TemporaryFolder;
using test::write_text;
namespace fs = std::filesystem;

Picture picture(std::uint8_t grey) { return {4, 2, std::vector<std::uint8_t>(4 * 2 * 3, grey)}; }

// Takes ffmpeg's place: keeps what it was told and what it was given.
fs::path stand_in(const TemporaryFolder& folder, const std::string& script) {
  const fs::path program = folder / "ffmpeg";
  write_text(program, "#!/bin/sh\nfor file; do :; done\n" + script);
  fs::permissions(program, fs::perms::owner_all);
  return program;
}

TEST(FilmWriter, HandsFfmpegRawFramesInOrder) {
  const TemporaryFolder folder;
  const fs::path ffmpeg = stand_in(folder, "cat > \"$file\"; echo \"$@\" > \"$file.words\"\n");
  const auto film = film_by_ffmpeg(ffmpeg, folder / "a b.mp4", 4, 2, 30);
  film->add(picture('x'));
  film->add(picture('y'));
  EXPECT_FALSE(fs::exists(folder / "a b.mp4"));
  EXPECT_EQ(film->finish(), folder / "a b.mp4");
  EXPECT_EQ(read_text(folder / "a b.mp4"), std::string(24, 'x') + std::string(24, 'y'));
  const std::string words = read_text(folder / "a b.mp4.partial.words");
  EXPECT_NE(words.find("-pix_fmt rgb24 -s 4x2 -framerate 30 -i -"), std::string::npos) << words;
}

TEST(FilmWriter, LeavesNothingOfAFilmThatFfmpegRefuses) {
  const TemporaryFolder folder;
  const fs::path ffmpeg = stand_in(folder, "cat > \"$file\"; exit 3\n");
  const auto film = film_by_ffmpeg(ffmpeg, folder / "film.mp4", 4, 2, 25);
  film->add(picture(1));
  EXPECT_THROW(film->finish(), std::runtime_error);
  EXPECT_FALSE(fs::exists(folder / "film.mp4"));
}

TEST(FilmWriter, NoticesAnFfmpegThatDies) {
  const TemporaryFolder folder;
  const fs::path ffmpeg = stand_in(folder, "exit 1\n");
  const auto film = film_by_ffmpeg(ffmpeg, folder / "film.mp4", 4, 2, 25);
  const Picture frame{400, 400, std::vector<std::uint8_t>(400 * 400 * 3)};
  EXPECT_THROW(
      {
        film->add(frame);  // more than a pipe holds
        film->add(frame);
      },
      std::runtime_error);
}

TEST(FilmWriter, FramesReplaceThoseOfAnOlderFilmOnly) {
  const TemporaryFolder folder;
  for (const char* name : {"000001.png", "000007.png", "mine.png", "1234567.png"}) {
    write_text(folder / name, "old");
  }
  const auto film = film_as_frames(folder.path());
  film->add(picture(1));
  film->add(picture(2));
  EXPECT_EQ(film->finish(), folder.path());
  EXPECT_NE(read_text(folder / "000001.png"), "old");
  EXPECT_TRUE(fs::exists(folder / "000002.png"));
  EXPECT_FALSE(fs::exists(folder / "000007.png"));
  EXPECT_EQ(read_text(folder / "mine.png"), "old");
  EXPECT_EQ(read_text(folder / "1234567.png"), "old");
}

TEST(FilmWriter, FindsProgramsAsAShellDoes) {
  const TemporaryFolder folder;
  const std::string before = std::getenv("PATH");
  setenv("PATH", ("/nowhere:" + folder.path().string()).c_str(), 1);
  EXPECT_TRUE(find_program("ffmpeg").empty());
  write_text(folder / "ffmpeg", "no program yet");
  EXPECT_TRUE(find_program("ffmpeg").empty());
  stand_in(folder, "");
  EXPECT_EQ(find_program("ffmpeg"), folder / "ffmpeg");
  setenv("PATH", before.c_str(), 1);
}

}  // namespace
}  // namespace arex::sim
