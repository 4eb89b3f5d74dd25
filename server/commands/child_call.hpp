// callInChild(): runs code that may crash or hang, such as a graphics driver, in a child process.
#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace enfilade::server {

struct ChildAnswer {
  std::string text;     ///< what the child sent, also before a crash
  std::string failure;  ///< why the child ended early, as "crashed (..)"; empty: it returned
};

using Send = std::function<void(const std::string& text)>;

/// Calls `function` in a copy of this process, and waits for its end. A child that runs for longer
/// than `limit` is killed. Call it before any thread starts: the child has only the calling thread.
/// Throws std::system_error.
ChildAnswer callInChild(const std::function<void(const Send&)>& function,
                        std::chrono::seconds limit = std::chrono::seconds(60));

}  // namespace enfilade::server
