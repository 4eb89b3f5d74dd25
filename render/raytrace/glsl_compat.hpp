// The subset of GLSL that render/shading.glsl.inc uses, for C++.
#pragma once

#include <algorithm>
#include <cmath>

namespace enfilade::render::glsl {

// NOLINTBEGIN: the names are GLSL's
struct vec3 {
  float x = 0, y = 0, z = 0;

  constexpr vec3() = default;
  constexpr explicit vec3(float all) : x(all), y(all), z(all) {}
  constexpr vec3(float x_, float y_, float z_) : x(x_), y(y_), z(z_) {}
};
// NOLINTEND

constexpr vec3 operator+(const vec3& a, const vec3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
constexpr vec3 operator-(const vec3& a, const vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
constexpr vec3 operator*(const vec3& a, const vec3& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
constexpr vec3 operator*(const vec3& a, float b) {
  return {a.x * b, a.y * b, a.z * b};
}
constexpr vec3 operator*(float a, const vec3& b) {
  return b * a;
}
constexpr float dot(const vec3& a, const vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
constexpr float max(float a, float b) {
  return a < b ? b : a;
}
constexpr float min(float a, float b) {
  return b < a ? b : a;
}
constexpr float clamp(float x, float low, float high) {
  return std::min(std::max(x, low), high);
}
constexpr vec3 mix(const vec3& a, const vec3& b, float t) {
  return a * (1.0f - t) + b * t;
}
constexpr float smoothstep(float from, float to, float x) {
  const float t = clamp((x - from) / (to - from), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}
inline float abs(float x) {
  return std::abs(x);
}
inline float sqrt(float x) {
  return std::sqrt(x);
}
inline vec3 exp(const vec3& v) {
  return {std::exp(v.x), std::exp(v.y), std::exp(v.z)};
}

}  // namespace enfilade::render::glsl
