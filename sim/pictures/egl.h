#pragma once

#include <memory>
#include <string>

/// Headless OpenGL. EGL and GL themselves stay in .cpp files.
namespace arex::sim {

struct EglOptions {
  bool software = false;  ///< pass over every GPU: Mesa's llvmpipe, whose bits are reproducible
  int rasterizer_threads = 0;  ///< llvmpipe's own threads; 0 draws in the calling thread
};

/// A headless OpenGL 4.5 context: on a GPU if an EGL device offers one, else on Mesa's software
/// rasterizer.
///
/// llvmpipe reads its settings from the environment when it starts, once per process: the first
/// context pins them. Its vector width is always pinned, so that every AVX2 host draws the same
/// bits.
///
/// A context serves one thread at a time. Every piece of GL work is bracketed by a `Current`, which
/// waits for its turn, binds the context to the calling thread and releases it again: any worker
/// thread may draw, and none of them owns the context.
class EglContext {
 public:
  /// @throws ConfigError, of the host, if no EGL platform gives OpenGL 4.5.
  explicit EglContext(const EglOptions& options);
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Binds the context to this thread for the object's lifetime. Not to be nested.
  class Current {
   public:
    explicit Current(const EglContext& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    const EglContext& context_;
  };

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace arex::sim
