#pragma once

namespace arex::app {

/// While it lives, SIGINT, SIGTERM and SIGHUP ask the command to end in good order; the second of
/// them ends the process at once. A SIGHUP that is ignored, as under nohup, stays so.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  /// The signal that came first; 0 for none.
  [[nodiscard]] static int signal();
};

}  // namespace arex::app
