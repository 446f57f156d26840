#pragma once

// Included by .cpp files only: OpenGL 4.5 as libOpenGL exports it, and its objects by RAII.
#include <GL/gl.h>
#include <GL/glext.h>

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace arex::sim::gl {

/// Owns one GL name. Created and destroyed while its context is current.
template <void (*kCreate)(GLsizei, GLuint*), void (*kDelete)(GLsizei, const GLuint*)>
class Object {
 public:
  Object() { kCreate(1, &id_); }
  ~Object() {
    if (id_ != 0) kDelete(1, &id_);
  }
  Object(Object&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  Object(const Object&) = delete;
  Object& operator=(const Object&) = delete;
  Object& operator=(Object&&) = delete;
  [[nodiscard]] GLuint id() const { return id_; }

 private:
  GLuint id_ = 0;
};

using Buffer = Object<glCreateBuffers, glDeleteBuffers>;
using VertexArray = Object<glCreateVertexArrays, glDeleteVertexArrays>;
using Framebuffer = Object<glCreateFramebuffers, glDeleteFramebuffers>;
using Renderbuffer = Object<glCreateRenderbuffers, glDeleteRenderbuffers>;

inline void create_texture_2d(GLsizei n, GLuint* ids) { glCreateTextures(GL_TEXTURE_2D, n, ids); }
using Texture2D = Object<create_texture_2d, glDeleteTextures>;

/// Fills a buffer once, for good.
template <class T>
void upload(const Buffer& buffer, const std::vector<T>& data) {
  // A buffer may not be empty; one element's room keeps an empty mesh drawable.
  const std::size_t bytes = data.size() * sizeof(T);
  glNamedBufferStorage(buffer.id(), static_cast<GLsizeiptr>(bytes == 0 ? sizeof(T) : bytes),
                       data.empty() ? nullptr : data.data(), 0);
}

/// A linked shader program.
class Program {
 public:
  /// @throws std::logic_error with the compiler's log. A null fragment source draws depth only.
  Program(const char* vertex_source, const char* fragment_source) : id_(glCreateProgram()) {
    attach(GL_VERTEX_SHADER, vertex_source);
    if (fragment_source != nullptr) attach(GL_FRAGMENT_SHADER, fragment_source);
    glLinkProgram(id_);
    GLint linked = 0;
    glGetProgramiv(id_, GL_LINK_STATUS, &linked);
    if (linked == 0) {
      std::string log(4096, '\0');
      glGetProgramInfoLog(id_, static_cast<GLsizei>(log.size()), nullptr, log.data());
      throw std::logic_error("shader: " + std::string(log.c_str()));
    }
  }
  ~Program() { glDeleteProgram(id_); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  [[nodiscard]] GLuint id() const { return id_; }
  /// @throws std::logic_error if the linked program has no such uniform.
  [[nodiscard]] GLint uniform(const char* name) const {
    const GLint location = glGetUniformLocation(id_, name);
    if (location < 0) throw std::logic_error("shader: no uniform " + std::string(name));
    return location;
  }

 private:
  void attach(GLenum type, const char* source) {
    const GLuint shader = glCreateShader(type);
    glShaderSource(shader, 1, &source, nullptr);
    glCompileShader(shader);
    GLint compiled = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    std::string log(4096, '\0');
    if (compiled == 0) {
      glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
      glDeleteShader(shader);
      throw std::logic_error("shader: " + std::string(log.c_str()));
    }
    glAttachShader(id_, shader);
    glDeleteShader(shader);
  }
  GLuint id_;
};

}  // namespace arex::sim::gl
