#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace arex {

/// Large buffers that others read for a while. What the last reader lets go of, on whatever thread,
/// serves again; its contents are what they were.
template <class T>
class BufferPool {
 public:
  /// A buffer that nobody reads; `make` is asked for a new one if there is none.
  template <class Make>
  [[nodiscard]] std::shared_ptr<T> take(const Make& make) {
    std::unique_ptr<T> buffer = shelf_->take();
    if (!buffer) buffer = make();
    // Readers may outlive the pool.
    return {buffer.release(), [shelf = shelf_](T* returned) { shelf->put(returned); }};
  }

 private:
  class Shelf {
   public:
    std::unique_ptr<T> take() {
      const std::lock_guard lock(mutex_);
      if (free_.empty()) return nullptr;
      std::unique_ptr<T> buffer = std::move(free_.back());
      free_.pop_back();
      return buffer;
    }
    void put(T* buffer) {
      const std::lock_guard lock(mutex_);
      free_.emplace_back(buffer);
    }

   private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<T>> free_;
  };

  std::shared_ptr<Shelf> shelf_ = std::make_shared<Shelf>();
};

}  // namespace arex
