#pragma once

namespace arex::test {

/// How many times the work a sanitizer's build may need for what a limit is set on.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr int kSlowdown = 10;
#else
inline constexpr int kSlowdown = 1;
#endif

}  // namespace arex::test
