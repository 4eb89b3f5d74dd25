// Move-only owners of GL objects, and the check for GL errors. Needs a current context.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace enfilade::render {

enum class GlKind : std::uint8_t {
  buffer,
  texture,  ///< with two dimensions
  textureArray,
  vertexArray,
  framebuffer,
  program
};

unsigned createGlObject(GlKind kind);
void deleteGlObject(GlKind kind, unsigned name) noexcept;

/// Owner of one GL object; name 0: empty.
template <GlKind kind>
class GlObject {
 public:
  GlObject() = default;
  explicit GlObject(unsigned name) : name_(name) {}
  ~GlObject() { reset(); }
  GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    if (this != &other) {
      reset();
      name_ = std::exchange(other.name_, 0);
    }
    return *this;
  }
  static GlObject create() { return GlObject(createGlObject(kind)); }
  unsigned name() const { return name_; }

 private:
  void reset() noexcept {
    if (name_ != 0) deleteGlObject(kind, name_);
  }
  unsigned name_ = 0;
};

using GlBuffer = GlObject<GlKind::buffer>;
using GlTexture = GlObject<GlKind::texture>;
using GlTextureArray = GlObject<GlKind::textureArray>;
using GlVertexArray = GlObject<GlKind::vertexArray>;
using GlFramebuffer = GlObject<GlKind::framebuffer>;
using GlProgram = GlObject<GlKind::program>;

/// Throws RenderError naming `stage` and the error if GL reports one.
void checkGl(const char* stage);

/// Compiles and links; throws RenderError with the compiler's log. `name` is for the message.
GlProgram buildProgram(const std::string& name, const std::string& vertexSource,
                       const std::string& fragmentSource);

}  // namespace enfilade::render
