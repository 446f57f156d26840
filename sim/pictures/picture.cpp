#include "pictures/picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "pictures/egl.h"
#include "pictures/gl.h"
#include "pictures/picture_mesh.h"
#include "pictures/picture_shaders.h"
#include "sensors/renderer_culling.h"

namespace arex::sim {
namespace {

constexpr int kSupersampling = 2;      // along each axis
constexpr GLsizei kShadowSize = 4096;  // texels a side
constexpr double kNear = 0.05;         // m
constexpr double kFar = 2.5;           // visibilities: the haze leaves 8 % of what is there
constexpr float kNoCut = 1e6F;         // m, above everything
const Vec3 kToSun = Vec3(-0.42, 0.38, 0.82).normalized();

Eigen::Matrix4f as_matrix(const Pose& pose) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = pose.R;
  m.topRightCorner<3, 1>() = pose.p;
  return m.cast<float>();
}

/// Triangles on the device, three vertices each.
class VertexSet {
 public:
  explicit VertexSet(const std::vector<PictureVertex>& vertices)
      : count_(static_cast<GLsizei>(vertices.size())) {
    gl::upload(buffer_, vertices);
    glVertexArrayVertexBuffer(array_.id(), 0, buffer_.id(), 0, sizeof(PictureVertex));
    const auto attribute = [&](GLuint index, GLint size, GLenum type, GLboolean normalised,
                               std::size_t offset) {
      glEnableVertexArrayAttrib(array_.id(), index);
      glVertexArrayAttribFormat(array_.id(), index, size, type, normalised,
                                static_cast<GLuint>(offset));
      glVertexArrayAttribBinding(array_.id(), index, 0);
    };
    attribute(0, 3, GL_FLOAT, GL_FALSE, offsetof(PictureVertex, p_W));
    attribute(1, 3, GL_FLOAT, GL_FALSE, offsetof(PictureVertex, normal_W));
    attribute(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(PictureVertex, colour));
  }

  void draw() const {
    glBindVertexArray(array_.id());
    glDrawArrays(GL_TRIANGLES, 0, count_);
  }
  void draw(const std::vector<worlds::Chunk>& chunks,
            const std::vector<std::uint32_t>& visible) const {
    std::vector<GLint> firsts;
    std::vector<GLsizei> counts;
    for (const std::uint32_t i : visible) {
      firsts.push_back(static_cast<GLint>(3 * chunks[i].first_triangle));
      counts.push_back(static_cast<GLsizei>(3 * chunks[i].triangle_count));
    }
    glBindVertexArray(array_.id());
    glMultiDrawArrays(GL_TRIANGLES, firsts.data(), counts.data(),
                      static_cast<GLsizei>(firsts.size()));
  }

 private:
  gl::VertexArray array_;
  gl::Buffer buffer_;
  GLsizei count_;
};

/// What the sun sees, drawn once.
struct ShadowMap {
  gl::Framebuffer framebuffer;
  gl::Texture2D depth;
  Eigen::Matrix4f sun_from_world;  ///< to texture coordinates and depth, each 0..1

  explicit ShadowMap(const worlds::Bounds& bounds) {
    glTextureStorage2D(depth.id(), 1, GL_DEPTH_COMPONENT32F, kShadowSize, kShadowSize);
    glTextureParameteri(depth.id(), GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTextureParameteri(depth.id(), GL_TEXTURE_COMPARE_FUNC, GL_GEQUAL);
    glTextureParameteri(depth.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(depth.id(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(depth.id(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(depth.id(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glNamedFramebufferTexture(framebuffer.id(), GL_DEPTH_ATTACHMENT, depth.id(), 0);
    glNamedFramebufferDrawBuffer(framebuffer.id(), GL_NONE);
    glNamedFramebufferReadBuffer(framebuffer.id(), GL_NONE);

    Mat3 R_SW;  // S: z towards the sun
    R_SW.row(2) = kToSun.transpose();
    R_SW.row(0) = Vec3::UnitZ().cross(kToSun).normalized().transpose();
    R_SW.row(1) = R_SW.row(2).cross(R_SW.row(0));
    Eigen::AlignedBox3d box;
    for (int corner = 0; corner < 8; ++corner) {
      box.extend(R_SW * Vec3(corner & 1 ? bounds.low.x() : bounds.high.x(),
                             corner & 2 ? bounds.low.y() : bounds.high.y(),
                             corner & 4 ? bounds.low.z() : bounds.high.z()));
    }
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    const Vec3 scale = box.sizes().cwiseMax(1e-3).cwiseInverse();
    m.topLeftCorner<3, 3>() = scale.asDiagonal() * R_SW;
    m.topRightCorner<3, 1>() = -scale.cwiseProduct(box.min());
    sun_from_world = m.cast<float>();
  }
};

/// The supersampled image under way.
struct Canvas {
  int width, height;
  gl::Framebuffer framebuffer;
  gl::Renderbuffer colour, depth;

  Canvas(int width_in, int height_in) : width(width_in), height(height_in) {
    glNamedRenderbufferStorage(colour.id(), GL_RGBA8, width, height);
    glNamedRenderbufferStorage(depth.id(), GL_DEPTH_COMPONENT32F, width, height);
    glNamedFramebufferRenderbuffer(framebuffer.id(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                   colour.id());
    glNamedFramebufferRenderbuffer(framebuffer.id(), GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                                   depth.id());
  }
};

/// The mean over each block of samples.
Picture shrink(const std::vector<std::uint8_t>& rgba, int width, int height) {
  Picture picture{width, height, {}};
  picture.rgb.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  const auto row = static_cast<std::size_t>(width) * kSupersampling;
  std::size_t out = 0;
  for (std::size_t v = 0; v < static_cast<std::size_t>(height); ++v) {
    for (std::size_t u = 0; u < static_cast<std::size_t>(width); ++u) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        unsigned sum = 0;
        for (std::size_t dv = 0; dv < kSupersampling; ++dv) {
          for (std::size_t du = 0; du < kSupersampling; ++du) {
            const std::size_t sample = (v * kSupersampling + dv) * row + u * kSupersampling + du;
            sum += rgba[4 * sample + channel];
          }
        }
        constexpr unsigned kSamples = kSupersampling * kSupersampling;
        picture.rgb[out++] = static_cast<std::uint8_t>((sum + kSamples / 2) / kSamples);
      }
    }
  }
  return picture;
}

PinholeCamera supersampled_camera(const PictureOptions& options) {
  PinholeCamera camera;
  camera.width = options.width * kSupersampling;
  camera.height = options.height * kSupersampling;
  camera.fx = camera.fy = camera.width / 2.0 / std::tan(options.field_of_view_rad / 2);
  camera.cx = (camera.width - 1) / 2.0;
  camera.cy = (camera.height - 1) / 2.0;
  return camera;
}

/// Reversed depth as in the depth renderer; image row 0 is GL's row 0.
Eigen::Matrix4f clip_from_camera(const PinholeCamera& camera) {
  Eigen::Matrix4f m;
  m << static_cast<float>(2 * camera.fx / camera.width), 0, 0, 0,  //
      0, static_cast<float>(2 * camera.fy / camera.height), 0, 0,  //
      0, 0, 0, static_cast<float>(kNear),                          //
      0, 0, 1, 0;
  return m;
}

float cut_height(const PictureOptions& options) {
  return options.cut_above_m < kNoCut ? static_cast<float>(options.cut_above_m) : kNoCut;
}

bool has_ceiling(const worlds::World& world) {
  return std::any_of(world.objects.begin(), world.objects.end(), [](const worlds::Object& o) {
    return o.surface_class == worlds::SurfaceClass::kCeiling;
  });
}

}  // namespace

struct PictureRenderer::Impl {
  EglContext context{EglOptions{}};
  std::vector<worlds::Chunk> chunks;
  bool interior = false;
  // Everything below lives while the context is current.
  struct Device {
    gl::Program shadow_program{kShadowVertexShader, nullptr};
    gl::Program sky_program{kSkyVertexShader, kSkyFragmentShader};
    gl::Program surface_program{kSurfaceVertexShader, kSurfaceFragmentShader};
    gl::VertexArray nothing;
    VertexSet world;
    ShadowMap shadow;
    std::optional<float> shadow_cut_above;
    std::optional<Canvas> world_canvas;  ///< the world alone
    std::optional<Canvas> frame_canvas;  ///< with the overlay
    struct View {
      Pose X_WC;
      PictureOptions options;
    };
    std::optional<View> world_view;  ///< what world_canvas shows

    explicit Device(const worlds::World& w)
        : world(picture_vertices(w.mesh, object_colours(w))), shadow(w.bounds) {
      glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
      glPixelStorei(GL_PACK_ALIGNMENT, 1);
      glEnable(GL_CLIP_DISTANCE0);
      draw_shadow(kNoCut);
    }

    /// A canvas of the camera's size, made anew if it has another.
    static const Canvas& canvas(std::optional<Canvas>& canvas, const PinholeCamera& camera) {
      if (!canvas || canvas->width != camera.width || canvas->height != camera.height) {
        canvas.emplace(camera.width, camera.height);
      }
      return *canvas;
    }

    /// Redraws the shadow map if what stands in the sun has changed.
    void draw_shadow(float cut_above) {
      if (shadow_cut_above == cut_above) return;
      shadow_cut_above = cut_above;
      glBindFramebuffer(GL_FRAMEBUFFER, shadow.framebuffer.id());
      glViewport(0, 0, kShadowSize, kShadowSize);
      glClearDepth(0.0);
      glEnable(GL_DEPTH_TEST);
      glDepthFunc(GL_GREATER);
      glClear(GL_DEPTH_BUFFER_BIT);
      glUseProgram(shadow_program.id());
      glUniformMatrix4fv(shadow_program.uniform("sun_from_world"), 1, GL_FALSE,
                         shadow.sun_from_world.data());
      glUniform1f(shadow_program.uniform("cut_above"), cut_above);
      world.draw();
    }
  };
  std::optional<Device> device;

  /// Draws the world into world_canvas unless that shows it already.
  void draw_world(const Pose& X_WC, const PictureOptions& options, const PinholeCamera& camera);
  void set_view(const gl::Program& program, const Pose& X_WC, const PinholeCamera& camera) const {
    glUseProgram(program.id());
    const Vec3f to_sun = kToSun.cast<float>();
    glUniform3fv(program.uniform("to_sun"), 1, to_sun.data());
    if (&program == &device->sky_program) {
      const Eigen::Matrix3f R_WC = X_WC.R.cast<float>();
      glUniformMatrix3fv(program.uniform("R_WC"), 1, GL_FALSE, R_WC.data());
      glUniform2f(program.uniform("half_extent"),
                  static_cast<float>(camera.width / 2.0 / camera.fx),
                  static_cast<float>(camera.height / 2.0 / camera.fy));
      return;
    }
    const Eigen::Matrix4f clip_from_world = clip_from_camera(camera) * as_matrix(X_WC.inverse());
    glUniformMatrix4fv(program.uniform("clip_from_world"), 1, GL_FALSE, clip_from_world.data());
    glUniformMatrix4fv(program.uniform("sun_from_world"), 1, GL_FALSE,
                       device->shadow.sun_from_world.data());
    const Vec3f eye = X_WC.p.cast<float>();
    glUniform3fv(program.uniform("p_WC"), 1, eye.data());
  }
};

PictureRenderer::PictureRenderer(const worlds::World& world) : impl_(std::make_unique<Impl>()) {
  impl_->chunks = world.mesh.chunks;
  impl_->interior = has_ceiling(world);
  const EglContext::Current current(impl_->context);
  impl_->device.emplace(world);
}

PictureRenderer::~PictureRenderer() {
  try {
    const EglContext::Current current(impl_->context);
    impl_->device.reset();
  } catch (const std::exception&) {
    // The context is lost, and what lay in it with it.
  }
}

void PictureRenderer::Impl::draw_world(const Pose& X_WC, const PictureOptions& options,
                                       const PinholeCamera& camera) {
  const bool drawn = device->world_view && device->world_view->options == options &&
                     device->world_view->X_WC.p == X_WC.p && device->world_view->X_WC.R == X_WC.R;
  if (drawn) return;
  device->world_view.reset();
  const float cut_above = cut_height(options);
  auto visible = visible_chunks(chunks, ViewVolume(camera, X_WC, kFar * options.visibility_m));
  std::erase_if(visible, [&](std::uint32_t i) { return chunks[i].bounds.min().z() > cut_above; });
  const bool headlight =
      options.light == PictureOptions::Light::kSunAndHeadlight ||
      (options.light == PictureOptions::Light::kAutomatic && interior && cut_above == kNoCut);

  device->draw_shadow(cut_above);
  const Canvas& canvas = device->canvas(device->world_canvas, camera);
  glBindFramebuffer(GL_FRAMEBUFFER, canvas.framebuffer.id());
  glViewport(0, 0, canvas.width, canvas.height);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CLIP_DISTANCE0);
  set_view(device->sky_program, X_WC, camera);
  glBindVertexArray(device->nothing.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);

  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CLIP_DISTANCE0);
  glDepthFunc(GL_GREATER);
  glClearDepth(0.0);
  glClear(GL_DEPTH_BUFFER_BIT);
  const gl::Program& program = device->surface_program;
  set_view(program, X_WC, camera);
  glUniform1f(program.uniform("cut_above"), cut_above);
  glUniform1f(program.uniform("visibility"), static_cast<float>(options.visibility_m));
  glUniform1f(program.uniform("headlight"), headlight ? 1.0F : 0.0F);
  glBindTextureUnit(0, device->shadow.depth.id());
  device->world.draw(chunks, visible);
  device->world_view = Impl::Device::View{X_WC, options};
}

Picture PictureRenderer::render(const Pose& X_WC, const PictureOptions& options,
                                const PictureOverlay& overlay) {
  const PinholeCamera camera = supersampled_camera(options);
  std::vector<std::uint8_t> rgba(static_cast<std::size_t>(camera.width) *
                                 static_cast<std::size_t>(camera.height) * 4);
  const auto extra = overlay_vertices(overlay);

  const EglContext::Current current(impl_->context);
  Impl::Device& device = *impl_->device;
  impl_->draw_world(X_WC, options, camera);
  const Canvas& canvas = device.canvas(device.frame_canvas, camera);
  const auto copy = [&](GLbitfield what) {
    glBlitNamedFramebuffer(device.world_canvas->framebuffer.id(), canvas.framebuffer.id(), 0, 0,
                           canvas.width, canvas.height, 0, 0, canvas.width, canvas.height, what,
                           GL_NEAREST);
  };
  copy(GL_COLOR_BUFFER_BIT);
  copy(GL_DEPTH_BUFFER_BIT);
  glBindFramebuffer(GL_FRAMEBUFFER, canvas.framebuffer.id());
  glViewport(0, 0, canvas.width, canvas.height);
  if (!extra.empty()) {
    glUseProgram(device.surface_program.id());
    glUniform1f(device.surface_program.uniform("cut_above"), kNoCut);
    VertexSet(extra).draw();
  }
  glReadPixels(0, 0, canvas.width, canvas.height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  return shrink(rgba, options.width, options.height);
}

Pose look_at(const Vec3& eye, const Vec3& target) {
  Mat3 R_WC;
  R_WC.col(2) = (target - eye).normalized();
  R_WC.col(0) = R_WC.col(2).cross(Vec3::UnitZ()).normalized();
  R_WC.col(1) = R_WC.col(2).cross(R_WC.col(0));
  return {R_WC, eye};
}

Picture render_picture(const worlds::World& world, const Pose& X_WC, const PictureOptions& options,
                       const PictureOverlay& overlay) {
  return PictureRenderer(world).render(X_WC, options, overlay);
}

}  // namespace arex::sim
