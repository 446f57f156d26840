#include "pictures/film_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

extern char** environ;

namespace arex::sim {
namespace {

namespace fs = std::filesystem;

class FfmpegFilm : public FilmWriter {
 public:
  FfmpegFilm(const fs::path& ffmpeg, fs::path file, int width, int height, int fps)
      : file_(std::move(file)), part_(file_.string() + ".partial") {
    const std::string size = std::to_string(width) + "x" + std::to_string(height);
    std::vector<std::string> words{ffmpeg.string(), "-loglevel", "error", "-y"};
    const auto add_words = [&](std::initializer_list<std::string> more) {
      words.insert(words.end(), more);
    };
    add_words({"-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size});
    add_words({"-framerate", std::to_string(fps), "-i", "-"});
    add_words({"-c:v", "libx264", "-preset", "veryfast", "-crf", "20", "-pix_fmt", "yuv420p"});
    add_words({"-movflags", "+faststart", "-f", "mp4", part_.string()});
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);

    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe to ffmpeg");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
    const int error =
        posix_spawn(&process_, ffmpeg.c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[0]);
    input_ = ends[1];
    if (error != 0) {
      close(input_);
      throw std::runtime_error(ffmpeg.string() + ": " + std::strerror(error));
    }
    std::signal(SIGPIPE, SIG_IGN);  // a dead ffmpeg is an error of write()
  }

  ~FfmpegFilm() override {
    end();
    std::error_code ignored;
    fs::remove(part_, ignored);
  }

  void add(const Picture& frame) override {
    for (std::size_t done = 0; done < frame.rgb.size();) {
      const ssize_t written = write(input_, frame.rgb.data() + done, frame.rgb.size() - done);
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) throw std::runtime_error(file_.string() + ": ffmpeg gave up");
      done += static_cast<std::size_t>(written);
    }
  }

  fs::path finish() override {
    if (end() != 0) throw std::runtime_error(file_.string() + ": ffmpeg failed");
    fs::rename(part_, file_);
    return file_;
  }

 private:
  // Waits for ffmpeg. @return its status, 0 for success.
  int end() {
    if (process_ < 0) return 0;
    close(input_);
    int status = 0;
    while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    return status;
  }

  fs::path file_;
  fs::path part_;
  pid_t process_ = -1;
  int input_ = -1;
};

class FrameFolder : public FilmWriter {
 public:
  explicit FrameFolder(fs::path folder) : folder_(std::move(folder)) {
    fs::create_directories(folder_);
    std::vector<fs::path> old;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      if (name.size() == 10 && name.ends_with(".png") &&
          name.find_first_not_of("0123456789") == 6) {
        old.push_back(entry.path());
      }
    }
    for (const fs::path& file : old) fs::remove(file);
  }

  void add(const Picture& frame) override {
    save_png(frame, folder_ / fmt::format("{:06}.png", ++count_));
  }

  fs::path finish() override { return folder_; }

 private:
  fs::path folder_;
  int count_ = 0;
};

}  // namespace

fs::path find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path program = fs::path(folder.empty() ? "." : folder) / name;
    if (access(program.c_str(), X_OK) == 0 && fs::is_regular_file(program)) return program;
  }
  return {};
}

std::unique_ptr<FilmWriter> film_by_ffmpeg(const fs::path& ffmpeg, const fs::path& file, int width,
                                           int height, int fps) {
  return std::make_unique<FfmpegFilm>(ffmpeg, file, width, height, fps);
}

std::unique_ptr<FilmWriter> film_as_frames(const fs::path& folder) {
  return std::make_unique<FrameFolder>(folder);
}

}  // namespace arex::sim
