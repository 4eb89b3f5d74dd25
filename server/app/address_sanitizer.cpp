// Options for builds with AddressSanitizer. Its interceptor of __tls_get_addr assumes the layout of
// glibc 2.19 for any TLS block that starts 16 bytes into a page. Mesa's libraries have such blocks,
// and the leak check at exit then crashes. These blocks come from malloc today, so that leaks are
// found without the interceptor. Fontconfig never frees the patterns of fonts that were looked up.

extern "C" const char* __asan_default_options();
extern "C" const char* __lsan_default_options();
extern "C" const char* __lsan_default_suppressions();

const char* __asan_default_options() {
  return "intercept_tls_get_addr=0";
}

const char* __lsan_default_options() {
  return "print_suppressions=0";
}

const char* __lsan_default_suppressions() {
  return "leak:libfontconfig\n";
}
