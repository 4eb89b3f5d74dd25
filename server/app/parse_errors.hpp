// Error texts of the command line parser, with remedies.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace enfilade::server {

/// `verb`: the command, after the parse that threw `error`. An unknown option comes first, because
/// other errors may follow from it.
std::string describeParseError(const CLI::App& verb, const CLI::ParseError& error);

}  // namespace enfilade::server
