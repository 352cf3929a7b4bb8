#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axlecast::tsubaki_sc::simulator {

// What a machine asks of its motor over time: points joined by straight lines, again and again.
class LoadProfile {
 public:
  // "S:W,S:W,...": seconds, rising from 0, and watts of electric power. "none": no profile. Empty when parsed, else
  // what would be right.
  [[nodiscard]] std::string Parse(std::string_view text);

  [[nodiscard]] bool empty() const { return points_.empty(); }
  // Watts, `seconds` >= 0 after its begin. Not of an empty one.
  [[nodiscard]] double At(double seconds) const;
  [[nodiscard]] std::string Text() const;

 private:
  struct Point {
    double seconds = 0;
    double watts = 0;
  };
  std::vector<Point> points_;
};

}  // namespace axlecast::tsubaki_sc::simulator
