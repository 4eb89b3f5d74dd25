#include <malloc.h>

#include "scene/import/import_worker.hpp"
#include "server/app/program.hpp"

namespace {

/// glibc takes memory from the kernel in steps of 128 KB, and each step waits until other threads
/// have faulted in their pages. A scene of a million objects takes a thousand steps. Setting one of
/// these ends the adaptation of the other, which is set to the largest value that it would reach.
void tuneAllocator() {
  mallopt(M_TOP_PAD, 64 << 20);
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
}

}  // namespace

int main(int argc, char** argv) {
  // The import worker is this program with a hidden command.
  if (const auto code = enfilade::scene::runImportWorker(argc, argv)) return *code;
  tuneAllocator();
  return static_cast<int>(enfilade::server::runProgram(argc, argv));
}
