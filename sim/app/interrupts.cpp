#include "app/interrupts.h"

#include <atomic>
#include <csignal>
#include <initializer_list>

namespace arex::app {
namespace {

std::atomic<int> first_signal{0};
static_assert(std::atomic<int>::is_always_lock_free);

void on_signal(int signal) {
  int none = 0;
  if (first_signal.compare_exchange_strong(none, signal)) return;
  std::signal(signal, SIG_DFL);
  raise(signal);
}

void handle(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    if (signal == SIGHUP && before.sa_handler == SIG_IGN) continue;
    sigaction(signal, &action, nullptr);
  }
}

}  // namespace

Interrupts::Interrupts() {
  first_signal = 0;
  handle(on_signal);
}

Interrupts::~Interrupts() { handle(SIG_DFL); }

int Interrupts::signal() { return first_signal; }

}  // namespace arex::app
