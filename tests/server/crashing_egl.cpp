// An EGL driver that crashes when libglvnd calls its entry point.
#include <cstdlib>

extern "C" [[gnu::visibility("default")]] int __egl_Main(unsigned, const void*, void*, void*) {
  std::abort();
}
