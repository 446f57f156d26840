#include "pictures/egl.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>

#include <array>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "config/config.h"

namespace arex::sim {
namespace {

/// Must run before Mesa's first display is initialised.
void pin_llvmpipe(const EglOptions& options) {
  static std::once_flag pinned;
  std::call_once(pinned, [&options] {
    setenv("EGL_LOG_LEVEL", "fatal", 0);  // what fails is said by us, once
    setenv("LP_NATIVE_VECTOR_WIDTH", "256", 1);
    setenv("LP_NUM_THREADS", std::to_string(options.rasterizer_threads).c_str(), 1);
  });
}

bool has_extension(const char* list, std::string_view name) {
  if (list == nullptr) return false;
  std::string_view rest(list);
  while (!rest.empty()) {
    const std::size_t end = rest.find(' ');
    if (rest.substr(0, end) == name) return true;
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  }
  return false;
}

template <class Function>
Function egl_function(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));
}

/// The displays worth trying, best first: each GPU, then Mesa without any device.
std::vector<EGLDisplay> candidate_displays(bool software) {
  std::vector<EGLDisplay> displays;
  const auto get_display =
      egl_function<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (get_display == nullptr) return displays;
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto query_devices = egl_function<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  const auto query_device = egl_function<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
  if (!software && has_extension(client, "EGL_EXT_platform_device") && query_devices != nullptr &&
      query_device != nullptr) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (!query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count)) count = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (has_extension(query_device(devices[i], EGL_EXTENSIONS), "EGL_MESA_device_software")) {
        continue;
      }
      displays.push_back(get_display(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
    }
  }
  if (has_extension(client, "EGL_MESA_platform_surfaceless")) {
    displays.push_back(get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  }
  return displays;
}

/// A surfaceless OpenGL 4.5 core context on `display`, or EGL_NO_CONTEXT.
EGLContext create_context(EGLDisplay display) {
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  if (!has_extension(extensions, "EGL_KHR_surfaceless_context") ||
      !has_extension(extensions, "EGL_KHR_no_config_context") || !eglBindAPI(EGL_OPENGL_API)) {
    return EGL_NO_CONTEXT;
  }
  const std::array<EGLint, 7> attributes{EGL_CONTEXT_MAJOR_VERSION,
                                         4,
                                         EGL_CONTEXT_MINOR_VERSION,
                                         5,
                                         EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                         EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                         EGL_NONE};
  return eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
}

}  // namespace

// EGL gives one display per platform and process, shared by all its contexts: it stays initialised
// until the process ends.
struct EglContext::Impl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  mutable std::mutex in_use;
};

EglContext::EglContext(const EglOptions& options) : impl_(std::make_unique<Impl>()) {
  pin_llvmpipe(options);
  for (EGLDisplay display : candidate_displays(options.software)) {
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr)) continue;
    EGLContext context = create_context(display);
    if (context == EGL_NO_CONTEXT) continue;
    impl_->display = display;
    impl_->context = context;
    break;
  }
  if (impl_->context == EGL_NO_CONTEXT) {
    throw ConfigError(
        "no EGL platform offers a headless OpenGL 4.5 context, expected a GPU's driver " +
        std::string("or Mesa's (libegl1, libegl-mesa0, libgl1-mesa-dri)"));
  }
}

EglContext::~EglContext() { eglDestroyContext(impl_->display, impl_->context); }

EglContext::Current::Current(const EglContext& context) : context_(context) {
  context_.impl_->in_use.lock();
  // The bound API is a thread's own state.
  if (!eglBindAPI(EGL_OPENGL_API) || !eglMakeCurrent(context_.impl_->display, EGL_NO_SURFACE,
                                                     EGL_NO_SURFACE, context_.impl_->context)) {
    context_.impl_->in_use.unlock();
    throw std::runtime_error("the OpenGL context cannot be bound to this thread");
  }
}

EglContext::Current::~Current() {
  eglMakeCurrent(context_.impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  context_.impl_->in_use.unlock();
}

}  // namespace arex::sim
