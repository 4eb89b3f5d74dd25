// Only in builds with AddressSanitizer. Where Mesa's libraries keep their thread-local storage, its
// interceptor of __tls_get_addr takes any block that starts 16 bytes into a page for one by
// glibc 2.19 and reads a bound out of what lies before it, which kills the search for leaks at the
// program's end. Such blocks come from malloc today: leaks are found without it.

extern "C" const char* __asan_default_options();

const char* __asan_default_options() {
  return "intercept_tls_get_addr=0";
}
