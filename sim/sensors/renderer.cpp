#include "sensors/renderer.h"

#include <numeric>
#include <optional>

#include "sensors/renderer_culling.h"
#include "sensors/renderer_gl.h"

namespace arex::sim {
namespace {

constexpr const char* kDepthVertexShader = R"(#version 450 core
layout(location = 0) in vec3 p_W;
layout(location = 0) uniform mat4 clip_from_world;
void main() { gl_Position = clip_from_world * vec4(p_W, 1.0); }
)";

/// Clip coordinates of a pinhole camera: z = near and w = Z, so that the depth buffer holds near/Z
/// (1 at the near plane, 0 at infinity). Image row 0 is GL's row 0, so that a read-back starts at
/// the top.
Eigen::Matrix4f clip_from_world(const PinholeCamera& camera, const Pose& X_WC, double near_m) {
  const double w = camera.width, h = camera.height;
  Eigen::Matrix4d clip_from_camera;
  clip_from_camera << 2 * camera.fx / w, 0, (2 * camera.cx + 1 - w) / w, 0,  //
      0, 2 * camera.fy / h, (2 * camera.cy + 1 - h) / h, 0,                  //
      0, 0, 0, near_m,                                                       //
      0, 0, 1, 0;
  const Pose X_CW = X_WC.inverse();
  Eigen::Matrix4d camera_from_world = Eigen::Matrix4d::Identity();
  camera_from_world.topLeftCorner<3, 3>() = X_CW.R;
  camera_from_world.topRightCorner<3, 1>() = X_CW.p;
  return (clip_from_camera * camera_from_world).cast<float>();
}

/// A world's mesh, its vertices on the device. What a view touches is gathered into one index list
/// per frame, nearest clusters first: two draw calls, which llvmpipe takes in less time than a draw
/// call per chunk.
class DeviceMesh {
 public:
  explicit DeviceMesh(const worlds::Mesh& mesh) : mesh_(cluster_mesh(mesh, kClusterTriangles)) {
    gl::upload(vertices_, mesh_.vertices);
    indices_.reserve(mesh_.triangles.size());
    glNamedBufferStorage(index_buffer_.id(), index_bytes(mesh_.triangles.size() + 1), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    glVertexArrayVertexBuffer(array_.id(), 0, vertices_.id(), 0, sizeof(Vec3f));
    glVertexArrayElementBuffer(array_.id(), index_buffer_.id());
    glEnableVertexArrayAttrib(array_.id(), 0);
    glVertexArrayAttribFormat(array_.id(), 0, 3, GL_FLOAT, GL_FALSE, 0);
  }

  /// Draws what `view` may see, nearest first; everything without a view. The far sides of solids
  /// are left out: half of the triangles of a forest's wood.
  Renderer::Statistics draw(const std::optional<ViewVolume>& view) {
    indices_.clear();
    std::vector<std::uint32_t> visible(mesh_.clusters.size());
    std::iota(visible.begin(), visible.end(), 0U);
    if (view) visible = visible_chunks(mesh_.clusters, *view);
    const std::size_t closed = gather(visible, true);
    const std::size_t open = gather(visible, false);
    glNamedBufferSubData(index_buffer_.id(), 0, index_bytes(indices_.size()), indices_.data());
    glBindVertexArray(array_.id());
    glFrontFace(GL_CW);  // the projection mirrors the picture
    glCullFace(GL_BACK);
    glEnable(GL_CULL_FACE);
    draw_range(0, closed);
    glDisable(GL_CULL_FACE);
    draw_range(closed, open);
    return {visible.size(), indices_.size()};
  }

 private:
  static constexpr std::uint32_t kClusterTriangles = 64;
  using Triangle = std::array<std::uint32_t, 3>;

  static GLsizeiptr index_bytes(std::size_t triangles) {
    return static_cast<GLsizeiptr>(triangles * sizeof(Triangle));
  }

  /// Appends the triangles of the closed or of the open clusters; returns their number.
  std::size_t gather(const std::vector<std::uint32_t>& clusters, bool closed) {
    const std::size_t before = indices_.size();
    for (const std::uint32_t i : clusters) {
      if (mesh_.closed[i] != closed) continue;
      const auto first = mesh_.triangles.begin() + mesh_.clusters[i].first_triangle;
      indices_.insert(indices_.end(), first, first + mesh_.clusters[i].triangle_count);
    }
    return indices_.size() - before;
  }

  static void draw_range(std::size_t first, std::size_t count) {
    if (count == 0) return;
    const std::size_t offset = first * sizeof(Triangle);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * count), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(offset));  // NOLINT: GL's way to say offset
  }

  ClusteredMesh mesh_;
  gl::VertexArray array_;
  gl::Buffer vertices_, index_buffer_;
  std::vector<Triangle> indices_;  ///< of the frame under way
};

/// Shaders and target of the depth-only pass.
struct DepthPass {
  gl::Program program{kDepthVertexShader, nullptr};
  gl::Framebuffer framebuffer;
  gl::Renderbuffer depth;

  explicit DepthPass(const PinholeCamera& camera) {
    glNamedRenderbufferStorage(depth.id(), GL_DEPTH_COMPONENT32F, camera.width, camera.height);
    glNamedFramebufferRenderbuffer(framebuffer.id(), GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                                   depth.id());
    glNamedFramebufferDrawBuffer(framebuffer.id(), GL_NONE);
    glNamedFramebufferReadBuffer(framebuffer.id(), GL_NONE);
    if (glCheckNamedFramebufferStatus(framebuffer.id(), GL_DRAW_FRAMEBUFFER) !=
        GL_FRAMEBUFFER_COMPLETE) {
      throw std::runtime_error("the graphics device has no 32-bit float depth target");
    }
  }
};

}  // namespace

struct Renderer::Impl {
  PinholeCamera camera;
  RendererOptions options;
  EglContext context;
  std::optional<DeviceMesh> mesh;
  std::optional<DepthPass> depth_pass;
  Statistics last_frame;

  Impl(const PinholeCamera& camera_in, const RendererOptions& options_in)
      : camera(camera_in), options(options_in), context(options_in.egl) {}
};

Renderer::Renderer(const worlds::World& world, const PinholeCamera& camera,
                   const RendererOptions& options)
    : impl_(std::make_unique<Impl>(camera, options)) {
  const EglContext::Current current(impl_->context);
  impl_->mesh.emplace(world.mesh);
  impl_->depth_pass.emplace(camera);
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
}

Renderer::~Renderer() {
  const EglContext::Current current(impl_->context);
  impl_->depth_pass.reset();
  impl_->mesh.reset();
}

void Renderer::render_inverse_depth(const Pose& X_WC, std::vector<float>& out) {
  const PinholeCamera& camera = impl_->camera;
  const RendererOptions& options = impl_->options;
  out.resize(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  std::optional<ViewVolume> view;
  if (options.cull) view.emplace(camera, X_WC, options.far_m);
  const Eigen::Matrix4f matrix = clip_from_world(camera, X_WC, options.near_m);
  {
    const EglContext::Current current(impl_->context);
    glBindFramebuffer(GL_FRAMEBUFFER, impl_->depth_pass->framebuffer.id());
    glViewport(0, 0, camera.width, camera.height);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glClearDepth(0.0);
    glClear(GL_DEPTH_BUFFER_BIT);
    glUseProgram(impl_->depth_pass->program.id());
    glUniformMatrix4fv(0, 1, GL_FALSE, matrix.data());
    impl_->last_frame = impl_->mesh->draw(view);
    glReadPixels(0, 0, camera.width, camera.height, GL_DEPTH_COMPONENT, GL_FLOAT, out.data());
  }
  // Chunks that reach beyond far_m are drawn whole: what lies beyond is cut here, so that the
  // picture does not depend on how the world is cut into chunks.
  const float scale = static_cast<float>(1 / options.near_m);
  const float least = static_cast<float>(options.near_m / options.far_m);
  float* value = out.data();
  const std::size_t pixels = out.size();
  for (std::size_t i = 0; i < pixels; ++i) value[i] = value[i] < least ? 0.0F : value[i] * scale;
}

Renderer::Statistics Renderer::last_frame() const { return impl_->last_frame; }
const std::string& Renderer::renderer_name() const { return impl_->context.renderer_name(); }

}  // namespace arex::sim
