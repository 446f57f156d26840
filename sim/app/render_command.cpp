#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "app/commands.h"
#include "app/render_infrared.h"
#include "config/config.h"
#include "files/files.h"
#include "pictures/film_writer.h"
#include "pictures/flight_pictures.h"
#include "report/run_record.h"
#include "run/file_io.h"
#include "run/scenario.h"
#include "run/snapshot_reader.h"

namespace arex::app {
namespace {

using View = sim::FlightPictures::View;

// Even, as video codecs want them; larger stills are for print.
constexpr int kFilmWidth = 960;
constexpr int kFilmHeight = 540;
constexpr int kMostFrames = 1'000'000;  // three days of drawing

View view_named(const std::string& name) {
  return name == "both" ? View::kBoth : name == "top" ? View::kTop : View::kChase;
}

// Beginning and end, s; what reaches beyond the flight is cut.
std::pair<double, double> span_of_film(const RenderArguments& arguments,
                                       const std::vector<sim::TimedPose>& truth) {
  const double first = truth.front().time_s;
  const double last = truth.back().time_s;
  const double begin = arguments.from_s.value_or(first);
  const double end = arguments.to_s.value_or(last);
  if (!(begin < last)) {
    throw ConfigError(fmt::format(
        "--from {:g}: lies behind the end of the flight, expected {:.2f} to less than {:.2f} s",
        begin, first, last));
  }
  if (!(end > first)) {
    throw ConfigError(fmt::format(
        "--to {:g}: lies before the start of the flight, expected more than {:.2f} to {:.2f} s",
        end, first, last));
  }
  if (!(begin < end)) {
    throw ConfigError(
        fmt::format("--from {:g}: lies behind --to {:g}, expected it before", begin, end));
  }
  return {std::max(begin, first), std::min(end, last)};
}

void draw_still(const RenderArguments& arguments, const worlds::World& world, const Pose& X_WO,
                const std::vector<sim::TimedPose>& truth) {
  const double begin = truth.front().time_s;
  const double end = truth.back().time_s;
  const double time = arguments.time_s.value_or(end / 2);
  if (!(time >= begin && time <= end)) {
    throw ConfigError(fmt::format(
        "--time {:g}: lies outside of the flight, expected {:.2f} to {:.2f} s", time, begin, end));
  }
  const View view = view_named(arguments.view.empty() ? "chase" : arguments.view);
  sim::FlightPictures pictures(world, X_WO, truth, view, {});
  sim::save_png(pictures.at(time, end), arguments.out);
  std::printf("%s: %.2f s of %.2f s\n", arguments.out.c_str(), time, end);
}

void draw_film(const RenderArguments& arguments, const worlds::World& world, const Pose& X_WO,
               const std::vector<sim::TimedPose>& truth) {
  const auto [begin, end] = span_of_film(arguments, truth);
  sim::PictureOptions options;
  options.width = kFilmWidth;
  options.height = kFilmHeight;
  const std::filesystem::path file = check_writable(arguments.out);
  const std::filesystem::path ffmpeg = sim::find_program("ffmpeg");
  const std::filesystem::path frames = file.parent_path() / (file.stem().string() + "_frames");
  std::optional<sim::OutputFolder> folder;
  if (ffmpeg.empty()) folder.emplace(frames);
  const View view = view_named(arguments.view.empty() ? "both" : arguments.view);
  sim::FlightPictures pictures(world, X_WO, truth, view, options);
  const auto film = ffmpeg.empty() ? sim::film_as_frames(frames)
                                   : sim::film_by_ffmpeg(ffmpeg, file, options.width,
                                                         options.height, arguments.fps);
  const double step = arguments.speed / arguments.fps;
  const double steps = std::floor((end - begin) / step);
  if (!(steps < kMostFrames)) {
    throw ConfigError("--speed, --fps: make a film of " + config_detail::format_scalar(steps + 1) +
                      " frames, expected at most " + std::to_string(kMostFrames));
  }
  const int count = 1 + static_cast<int>(steps);
  for (int i = 0; i < count; ++i) {
    const double time = begin + i * step;
    film->add(pictures.at(time, time));
    if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\rframe %d of %d ", i + 1, count);
  }
  if (isatty(STDERR_FILENO)) std::fputc('\n', stderr);
  const std::filesystem::path written = film->finish();
  std::printf("%s: %d frames, %.1f s of flight in %.1f s\n", written.c_str(), count, end - begin,
              count / static_cast<double>(arguments.fps));
  if (ffmpeg.empty()) {
    std::fprintf(stderr,
                 "arex: ffmpeg is not on PATH, so there are single frames; later:\n"
                 "  ffmpeg -framerate %d -i %s/%%06d.png -pix_fmt yuv420p %s\n",
                 arguments.fps, written.c_str(), file.c_str());
  }
}

// Of a recording nobody knows the world unless the configuration said it.
void check_world_known(const std::filesystem::path& folder) {
  const auto summary = sim::read_summary(folder);
  if (!summary || !summary->contains("replay")) return;
  if ((*summary)["replay"].value("world_known", false)) return;
  throw ConfigError(folder.string() +
                    ": is a replay that knows no world, expected a run, or a replay with --config "
                    "of the flight's resolved.yaml");
}

// A part of a snapshot: no world is needed.
int draw_part(const RenderArguments& arguments) {
  const auto named =
      std::find(sim::kSnapshotParts.begin(), sim::kSnapshotParts.end(), arguments.what);
  const auto part = static_cast<sim::SnapshotPart>(named - sim::kSnapshotParts.begin());
  check_writable(arguments.out);
  const sim::ReadSnapshot read = sim::read_snapshot(arguments.folder, part, arguments.time_s);
  sim::save_png(sim::draw_snapshot(read.snapshot, part), arguments.out);
  std::printf("%s: %s at %s s\n", arguments.out.c_str(), arguments.what.c_str(), read.name.c_str());
  return 0;
}

}  // namespace

int render(const RenderArguments& arguments) {
  const std::filesystem::path folder = arguments.folder;
  const std::string ending = std::filesystem::path(arguments.out).extension().string();
  if (ending != ".png" && ending != ".mp4") {
    throw ConfigError("--out " + arguments.out + ": expected FILE.png or FILE.mp4");
  }
  if (!arguments.what.empty() && ending != ".png") {
    throw ConfigError("--out " + arguments.out + ": --what draws pictures, expected FILE.png");
  }
  if (!sim::is_run_folder(folder)) {
    throw ConfigError(folder.string() +
                      (std::filesystem::exists(folder) ? ": holds no run" : ": does not exist") +
                      ", expected a run folder");
  }
  if (!arguments.what.empty() && arguments.what != "infrared") return draw_part(arguments);
  check_world_known(folder);
  const std::vector<sim::TimedPose> truth = sim::read_tum(folder / "truth.tum");
  if (truth.size() < 2) {
    throw ConfigError((folder / "truth.tum").string() +
                      ": holds no flight, expected two poses and more");
  }
  check_writable(arguments.out);
  const sim::Scenario scenario = sim::load_scenario(folder / "resolved.yaml", {}, {});
  const worlds::World world = scenario.build_world();
  const Pose X_WO = sim::start_pose(world);
  if (arguments.what == "infrared") {
    draw_infrared(arguments, scenario, world, truth);
  } else if (ending == ".png") {
    draw_still(arguments, world, X_WO, truth);
  } else {
    draw_film(arguments, world, X_WO, truth);
  }
  return 0;
}

}  // namespace arex::app
