#include "math/fingerprint.h"

#include <fmt/format.h>

#include "math/mix.h"

namespace arex {

std::string Fingerprint::text() const { return fmt::format("{:016x}", mix_bits(state_)); }

}  // namespace arex
