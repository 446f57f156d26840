#pragma once

#include <string>
#include <vector>

#include "support/process.h"

namespace arex {

/// Runs the binary to its end.
inline test::ProcessResult run_arex(const std::vector<std::string>& arguments) {
  return test::run_process(AREX_BINARY, arguments);
}

}  // namespace arex
