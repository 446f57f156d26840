// Writes what the browser test opens: FOLDER/run, FOLDER/old (without the growth of its cloud) and
// FOLDER/sweep, FOLDER/cube, FOLDER/few (half of one side failed) and FOLDER/none (all did), each
// with its report; FOLDER/report.html compares the two runs, FOLDER/evaluation/report.html two
// estimates with the run's truth.

#include <cstdio>
#include <filesystem>

#include "files/files.h"
#include "report/comparison_report.h"
#include "report/evaluation_report.h"
#include "report/page.h"
#include "report/run_report.h"
#include "synthetic_run.h"

int main(int argc, char** argv) {
  using namespace arex::sim;
  using arex::write_atomically;
  if (argc != 2) {
    std::fprintf(stderr, "usage: report_fixture FOLDER\n");
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  for (const char* name : {"run", "old"}) {
    test::write_synthetic_run(folder / name, {});
    if (name == std::string("old")) std::filesystem::remove(folder / name / "cloud_growth.csv");
    const RunRecord run = read_run(folder / name, kMaxReportPoints);
    write_atomically(folder / name / "report.html", run_report_html(run));
  }
  test::write_synthetic_sweep(folder / "sweep");
  test::write_synthetic_hypercube(folder / "cube");
  test::write_synthetic_failures(folder / "few", 2);
  test::write_synthetic_failures(folder / "none", 0);
  for (const char* name : {"sweep", "cube", "few", "none"}) {
    const std::filesystem::path sweep = folder / name;
    write_atomically(sweep / "report.html",
                     comparison_report_html(read_results({sweep}), "Sweep", sweep));
  }
  write_atomically(
      folder / "report.html",
      comparison_report_html(read_results({folder / "run", folder / "old"}), "Two runs", folder));
  std::vector<Trajectory> estimates;
  for (const char* name : {"estimate.tum", "truth.tum"}) {
    estimates.push_back(read_trajectory(folder / "run" / name));
  }
  std::filesystem::create_directory(folder / "evaluation");
  write_atomically(folder / "evaluation" / "report.html",
                   evaluation_report_html(compare(estimates.back(), estimates, {})));
  return 0;
}
