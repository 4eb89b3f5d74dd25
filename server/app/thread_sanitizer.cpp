// Suppressions for builds with ThreadSanitizer. Mesa's software rasteriser and the libraries of
// fonts are not instrumented, so their threads produce false reports. Our threads stay checked.

extern "C" const char* __tsan_default_suppressions();

const char* __tsan_default_suppressions() {
  return "race:swrast_dri.so\nrace:libfontconfig\nrace:libpango\nrace:libglib\nrace:libgobject\n";
}
