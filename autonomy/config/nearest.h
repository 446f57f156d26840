#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace arex {

/// The known name that a given one most likely stands for, for 'did you mean'. @pre known not empty
std::string nearest(std::string_view given, const std::vector<std::string>& known);

}  // namespace arex
