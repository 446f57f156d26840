#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "config/nearest.h"

namespace arex {

/// The implementations of one seam, by the names that scenarios give them.
///
/// @tparam Context what a factory is told beside its parameters
template <class Module, class Context>
class Registry {
 public:
  struct Type {
    std::string name;
    std::string meaning;
    /// Every parameter that a section holds. @throws ConfigError for what is none of them.
    std::function<std::vector<ParameterInfo>(const ConfigNode& section)> parameters;
    std::function<std::unique_ptr<Module>(const ConfigNode& section, const Context&)> make;
  };

  /// @param kind what its entries are, for messages: "odometry source"
  explicit Registry(std::string kind) : kind_(std::move(kind)) {}

  /// @throws std::logic_error if the name is taken.
  void add(Type type) {
    if (find(type.name)) throw std::logic_error(kind_ + " '" + type.name + "' exists already");
    types_.push_back(std::move(type));
  }

  /// Adds a type whose parameters are a config struct, with its defaults.
  template <class Config>
  void add(const std::string& name, const std::string& meaning,
           std::function<std::unique_ptr<Module>(const Config&, const Context&)> make) {
    const auto read = [](const ConfigNode& section) {
      Config config;
      read_config(section, config);
      return config;
    };
    add({name, meaning,
         [read](const ConfigNode& section) { return list_parameters(read(section)); },
         [read, make](const ConfigNode& section, const Context& context) {
           return make(read(section), context);
         }});
  }

  /// Null if there is none of that name.
  [[nodiscard]] const Type* find(std::string_view name) const {
    const auto type =
        std::find_if(types_.begin(), types_.end(), [&](const Type& t) { return t.name == name; });
    return type == types_.end() ? nullptr : &*type;
  }

  /// @throws ConfigError at `where` that names the nearest.
  [[nodiscard]] const Type& at(const std::string& name, const std::string& where) const {
    if (const Type* type = find(name)) return *type;
    throw ConfigError(where + ": unknown " + kind_ + " '" + name + "'; did you mean '" +
                      nearest(name, names()) + "'?");
  }

  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const Type& type : types_) names.push_back(type.name);
    return names;
  }
  [[nodiscard]] const std::vector<Type>& types() const { return types_; }

 private:
  std::string kind_;
  std::vector<Type> types_;
};

/// What a section says, over values given.
template <class Config>
Config read_over(Config config, const ConfigNode& section) {
  read_config(section, config);
  return config;
}

/// For modules without parameters of their own.
struct NoParameters {
  void fields(auto& /*f*/) {}
};

}  // namespace arex
