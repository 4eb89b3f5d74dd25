// Test fixture that starts the program in its own folder, as its users do.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/server/small_room.hpp"
#include "tests/support/temporary_folder.hpp"

extern char** environ;

namespace enfilade::server::testing {

inline std::string readText(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

inline void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

/// A fixture with the small room as room.obj.
class ProgramFixture : public ::testing::Test {
 protected:
  struct Ended {
    int code = -1;
    std::string out, err;
  };

  void SetUp() override { write(folder_ / "room.obj", makeSmallRoomObj()); }

  std::string getPath(const std::string& name) const { return (folder_ / name).string(); }

  pid_t start(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), ENFILADE_PROGRAM);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    const int flags = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_addopen(&actions, 1, getPath("stdout").c_str(), flags, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, getPath("stderr").c_str(), flags, 0600);
    pid_t child = -1;
    EXPECT_EQ(posix_spawn(&child, ENFILADE_PROGRAM, &actions, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    return child;
  }

  static int awaitExitCode(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  Ended run(const std::vector<std::string>& arguments) const {
    const int code = awaitExitCode(start(arguments));
    return {code, readText(getPath("stdout")), readText(getPath("stderr"))};
  }

  /// The port from the ready line, once it was printed.
  int awaitReady() const {
    for (int i = 0; i < 3000; ++i) {
      const auto ready = nlohmann::json::parse(readText(getPath("stdout")), nullptr, false);
      if (!ready.is_discarded() && ready.value("ready", false)) return ready.at("port");
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return 0;
  }

  const tests::TemporaryFolder own_;
  const std::filesystem::path folder_ = own_.getPath();
};

}  // namespace enfilade::server::testing
