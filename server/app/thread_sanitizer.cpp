// Only in builds with ThreadSanitizer. Mesa's software rasteriser is not instrumented, so that its
// own threads look like races to the sanitizer; ours are still watched.

extern "C" const char* __tsan_default_suppressions();

const char* __tsan_default_suppressions() {
  return "race:swrast_dri.so\n";
}
