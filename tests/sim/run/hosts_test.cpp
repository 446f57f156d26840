// The same bits on every host: what differs between hosts is imitated by what libraries are told
// about this one, for child processes that fly.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>

#include "math/fingerprint.h"
#include "support/process.h"
#include "support/temporary_folder.h"

namespace arex::test {
namespace {

/// Hosts by what the environment says about them.
const std::vector<std::vector<std::string>> kHosts{
    {},
    {"GALLIUM_OVERRIDE_CPU_CAPS=sse4.1", "LP_NATIVE_VECTOR_WIDTH=128"},
    {"GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4"},
    {"GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4,-ERMS,-AVX512F,-SSE4_1"},
    {"LC_ALL=C.UTF-8", "TZ=Pacific/Chatham", "MALLOC_PERTURB_=85"},
};

/// Runs a program in an environment with these variables.
ProcessResult run_with(const std::vector<std::string>& variables, const std::string& program,
                       const std::vector<std::string>& arguments) {
  std::vector<std::string> all = variables;
  all.push_back(program);
  all.insert(all.end(), arguments.begin(), arguments.end());
  return run_process("env", all);
}

nlohmann::json fly(const std::vector<std::string>& variables, const std::string& scenario,
                   const std::vector<std::string>& settings) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments{"run", AREX_SOURCE_DIR "/scenarios/" + scenario};
  for (const std::string& setting : settings) {
    arguments.insert(arguments.end(), {"--set", setting});
  }
  arguments.insert(arguments.end(), {"--quiet", "--no-report", "--out", (folder / "run").string()});
  const ProcessResult result = run_with(variables, AREX_BINARY, arguments);
  EXPECT_LE(result.exit_code, 1) << result.err;
  return nlohmann::json::parse(read_text(folder / "run/summary.json"));
}

/// What a summary says about the flight, not about the host: all but the times.
nlohmann::json flown(nlohmann::json summary) {
  for (const char* key : {"wall_time_s", "cpu_time_s", "real_time_factor"}) summary.erase(key);
  for (const char* part : {"planner", "exploration"}) {
    if (!summary[part].is_object()) continue;
    summary[part].erase("median_ms");
    summary[part].erase("p99_ms");
  }
  return summary;
}

void expect_the_same_everywhere(const std::string& scenario,
                                const std::vector<std::string>& settings) {
  const nlohmann::json here = flown(fly({}, scenario, settings));
  EXPECT_GT(here["distance_m"], 1.5);  // it flew
  for (const std::vector<std::string>& host : kHosts) {
    const nlohmann::json there = flown(fly(host, scenario, settings));
    EXPECT_EQ(nlohmann::json::diff(here, there).dump(), "[]")
        << scenario << " on " << (host.empty() ? "this host" : host.front());
  }
}

TEST(Hosts, AForestIsFlownTheSameOnAll) {
  expect_the_same_everywhere("forest_small.yaml", {"mission.max_time_s=14", "depth.rate_hz=10"});
}

TEST(Hosts, AGarageIsFlownTheSameOnAll) {
  expect_the_same_everywhere("garage_small.yaml", {"mission.max_time_s=14", "depth.rate_hz=10"});
}

/// What this process's libm answers: a fingerprint.
std::string libm_answers() {
  void* libm = dlopen("libm.so.6", RTLD_NOW);
  if (libm == nullptr) return "no libm";
  Fingerprint hash;
  for (const char* name : {"sin", "exp", "log", "tan", "atan"}) {
    auto* function = reinterpret_cast<double (*)(double)>(dlsym(libm, name));
    if (function == nullptr) return std::string("no ") + name;
    for (int i = 1; i < 20'000; ++i) hash.add(std::array{function(1e-3 * i)});
  }
  return hash.text();
}

// The imitation works: glibc's own functions do answer otherwise. On a host without FMA there is
// nothing to switch off, nor does the simulator run.
TEST(Hosts, WhatImitatesThemMakesADifferenceToLibm) {
  const std::string self = "/proc/self/exe";
  const std::string program = std::filesystem::read_symlink(self).string();
  const std::string here = run_with({}, program, {"--libm"}).out;
  EXPECT_EQ(here, libm_answers());
  EXPECT_NE(run_with(kHosts[2], program, {"--libm"}).out, here);
}

// No library of the process calls a function of libm whose result is not fixed by IEEE 754.
TEST(Hosts, NothingButExactFunctionsComesFromLibm) {
  static const std::set<std::string> kExact{
      "sqrt",           "sqrtf",      "sqrtl",         "floor",        "floorf",
      "ceil",           "ceilf",      "trunc",         "truncf",       "round",
      "roundf",         "rint",       "rintf",         "nearbyint",    "nearbyintf",
      "lround",         "lroundf",    "llround",       "lrint",        "lrintf",
      "llrint",         "fmod",       "fmodf",         "remainder",    "fma",
      "fmaf",           "ldexp",      "ldexpf",        "ldexpl",       "frexp",
      "frexpf",         "frexpl",     "modf",          "modff",        "modfl",
      "scalbn",         "scalbnf",    "nextafter",     "nextafterf",   "copysign",
      "fdim",           "fmax",       "fmin",          "fmaxf",        "fminf",
      "logb",           "ilogb",      "feraiseexcept", "floorl",       "ceill",
      "fmodl",          "fesetround", "fegetround",    "feholdexcept", "fesetenv",
      "feupdateenv",    "fegetenv",   "feclearexcept", "fetestexcept", "fedisableexcept",
      "feenableexcept", "signgam"};
  const ProcessResult result = run_with({"LD_DEBUG=bindings", "LD_BIND_NOW=1"}, AREX_BINARY,
                                        {"validate", AREX_SOURCE_DIR "/scenarios/forest.yaml"});
  ASSERT_EQ(result.exit_code, 0) << result.err.substr(0, 1000);
  const std::regex binding(R"(binding file (\S+) \[\d+\] to (\S+) \[\d+\]: normal symbol `(\w+)')");
  int exact = 0;
  std::set<std::string> of_ours;
  for (auto at = std::sregex_iterator(result.err.begin(), result.err.end(), binding);
       at != std::sregex_iterator(); ++at) {
    const std::string from = (*at)[1], to = (*at)[2], symbol = (*at)[3];
    const auto is_libm = [](const std::string& file) {
      return file.find("/libm.so") != std::string::npos;
    };
    // PCL names things in clouds, after the flight, and VTK comes with its files: nothing of them
    // decides what is flown or measured.
    // Of OpenCV, Lucas-Kanade and corners fly, which ask libm for nothing; what it is linked with
    // besides (LAPACK, Fortran, calibration, networks) is never called.
    bool flies = true;
    for (const char* idle : {"/libvtk", "/libpcl_", "/libopencv_", "/liblapack", "/libgfortran"}) {
      flies = flies && from.find(idle) == std::string::npos;
    }
    if (is_libm(to) && !is_libm(from) && flies) {
      EXPECT_TRUE(kExact.contains(symbol)) << from << " calls libm's " << symbol;
      ++exact;
    }
    if (from.find("libmujoco") != std::string::npos && to.find(".so") == std::string::npos) {
      of_ours.insert(symbol);
    }
  }
  EXPECT_GT(exact, 0);
  for (const char* name : {"sin", "pow", "atan2", "acos"}) {
    EXPECT_TRUE(of_ours.contains(name)) << "MuJoCo's " << name;
  }
}

// Reciprocals, their roots and x87's transcendental instructions are each vendor's own. Embree has
// reciprocals; Scene keeps them out of its answers.
TEST(Hosts, NoInstructionIsRunWhoseResultIsTheVendorsChoice) {
  const ProcessResult libraries = run_process("ldd", {AREX_BINARY});
  ASSERT_EQ(libraries.exit_code, 0);
  std::vector<std::string> files{AREX_BINARY};
  for (const char* name :
       {"libmujoco", "liboctomap", "liboctomath", "liblbfgs", "libpcl_common", "libccd"}) {
    std::smatch path;
    const std::regex line(std::string(name) + R"(\.so\S* => (\S+))");
    if (std::regex_search(libraries.out, path, line)) files.push_back(path[1]);
  }
  EXPECT_GE(files.size(), 6U);
  const std::regex theirs(
      R"(\t(v?rcp(14)?[ps]s|v?rsqrt(14)?[ps]s|fsin|fcos|fsincos|fptan|fpatan|f2xm1|fyl2x|fyl2xp1)\s)");
  for (const std::string& file : files) {
    const ProcessResult code = run_process("objdump", {"-d", "--no-show-raw-insn", file});
    ASSERT_EQ(code.exit_code, 0) << file;
    EXPECT_GT(code.out.size(), 10'000U) << file;
    std::istringstream lines(code.out);
    for (std::string line; std::getline(lines, line);) {
      if (line.find("rcp") == std::string::npos && line.find("rsqrt") == std::string::npos &&
          line.find("\tf") == std::string::npos) {
        continue;
      }
      EXPECT_FALSE(std::regex_search(line, theirs)) << file << ": " << line;
    }
  }
}

}  // namespace
}  // namespace arex::test

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--libm") {
    std::fputs(arex::test::libm_answers().c_str(), stdout);
    return 0;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
