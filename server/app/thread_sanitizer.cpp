// Suppressions for builds with ThreadSanitizer. Mesa's software rasteriser is not instrumented, so
// its threads produce false reports. Our threads stay checked.

extern "C" const char* __tsan_default_suppressions();

const char* __tsan_default_suppressions() {
  return "race:swrast_dri.so\n";
}
