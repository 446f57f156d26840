#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "config/registry.h"
#include "exploration/explorer.h"
#include "odometry/odometry_source.h"
#include "planning/local_planner.h"

/// The modules of which a scenario chooses one by name, and the door for those of other people.
///
/// A plug-in is a shared library that includes headers of autonomy/ only and says
///
///     AREX_PLUGIN(modules) {
///       modules.explorers.add<MyConfig>("my_explorer", "what it does",
///           [](const MyConfig& config, const arex::ModuleContext& context) {
///             return std::make_unique<MyExplorer>(config, context.config.mapping.resolution_m);
///           });
///     }
///
/// A scenario names it in `plugins`, chooses `exploration.strategy: my_explorer`, and sets its
/// parameters under `modules.my_explorer`.
namespace arex {

struct StackConfig;

/// What a module is told beside its own parameters.
struct ModuleContext {
  const StackConfig& config;  ///< of the whole stack; lives as long as the module
  std::uint64_t seed = 0;     ///< of its random streams
};

struct Modules {
  Registry<OdometrySource, ModuleContext> odometry{"odometry source"};
  Registry<Explorer, ModuleContext> explorers{"exploration strategy"};
  Registry<LocalPlanner, ModuleContext> planners{"local planner"};
};

/// Those that ship, and those of the plug-ins loaded so far.
Modules& modules();

/// Loads a shared library, once however often it is asked. @throws ConfigError at `where` for what
/// is none, was built against other headers or by another compiler, or lacks a symbol.
void load_plugin(const std::string& file, const std::string& where);

/// What a plug-in was built with: no two builds that differ in it can share an object.
inline constexpr std::string_view kPluginAbi = "arex 1, g++ " __VERSION__;

}  // namespace arex

/// Begins the function that a plug-in registers its modules in. `modules` names a parameter, which
/// no parentheses may enclose.
#define AREX_PLUGIN(modules)                                                             \
  extern "C" const char* arex_plugin_abi() { return arex::kPluginAbi.data(); }           \
  static void arex_register_modules(arex::Modules&);                                     \
  extern "C" void arex_plugin_register(arex::Modules& to) { arex_register_modules(to); } \
  /* NOLINTNEXTLINE(bugprone-macro-parentheses) */                                       \
  static void arex_register_modules(arex::Modules& modules)
