#include <unistd.h>

#include <cstring>

// Compiled for the baseline CPU and run before any other initialiser: everything else may hold
// AVX2.
namespace {

void write_line(const char* text) {
  if (write(STDERR_FILENO, text, std::strlen(text)) < 0) _exit(2);
}

__attribute__((constructor(101))) void check_cpu() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("bmi2")) {
    return;
  }
  write_line("arex: this CPU has no AVX2, FMA and BMI2; expected an x86-64-v3 host\n");
  _exit(2);
}

}  // namespace
