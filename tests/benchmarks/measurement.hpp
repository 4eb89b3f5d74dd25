// Shared helpers of all benchmark programs: clock, quantiles, result lines, command line.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/base/elapsed.hpp"

namespace enfilade::benchmarks {

using Clock = std::chrono::steady_clock;

using scene::measureSecondsSince;

/// The `q` quantile (0..1) of the values; NaN without values.
inline double computeQuantile(std::vector<double> values, double q) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

/// JSON has no NaN and infinity; they become null.
inline nlohmann::json toJsonNumber(double x) {
  return std::isfinite(x) ? nlohmann::json(x) : nlohmann::json(nullptr);
}

/// --quick, --out FILE (JSON lines; without it only the table on stdout), --only PART of a name.
struct Arguments {
  bool quick = false;
  std::string out, only;

  Arguments(int argc, char** argv) {
    for (int k = 1; k < argc; ++k) {
      const std::string argument = argv[k];
      if (argument == "--quick") {
        quick = true;
      } else if ((argument == "--out" || argument == "--only") && k + 1 < argc) {
        (argument == "--out" ? out : only) = argv[++k];
      } else {
        std::fprintf(stderr, "usage: %s [--quick] [--out FILE] [--only PART_OF_A_NAME]\n", argv[0]);
        std::exit(2);
      }
    }
  }
  bool wants(const std::string& name) const { return name.find(only) != std::string::npos; }
};

/// Writes one JSON object a line, for report.py.
class Results {
 public:
  explicit Results(const Arguments& arguments) {
    if (arguments.out.empty()) return;
    file_.open(arguments.out);
    if (!file_) {
      std::fprintf(stderr, "cannot write %s\n", arguments.out.c_str());
      std::exit(1);
    }
  }
  void add(const nlohmann::json& line) {
    if (file_.is_open()) file_ << line.dump() << std::endl;
  }

 private:
  std::ofstream file_;
};

}  // namespace enfilade::benchmarks
