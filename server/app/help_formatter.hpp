// HelpFormatter: the layout of --help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace enfilade::server {

/// "TEXT:HOST:PORT" -> "HOST:PORT"; "TEXT" -> "TEXT".
std::string formatValueName(std::string type);

/// Prints each option with its value and default, without C++ types: "--listen HOST:PORT
/// (127.0.0.1:7878)".
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override;
};

}  // namespace enfilade::server
