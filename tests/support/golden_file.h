#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace axlecast {

// One row of a golden file: the text between the bars, without the blanks around it.
struct GoldenRow {
  std::string where;  // file:line
  std::vector<std::string> columns;
};

// The rows of golden/<name> beside the test's own source file (pass __FILE__). Rows are lines; `#` begins a comment
// line, which names the rows' source. A file that is missing, empty or has a row of other width fails the test.
inline std::vector<GoldenRow> GoldenRows(const std::string& source_file, const std::string& name,
                                         std::size_t width) {
  const std::string path = source_file.substr(0, source_file.rfind('/') + 1) + "golden/" + name;
  std::ifstream file(path);
  std::vector<GoldenRow> rows;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (line.empty() || line.front() == '#') continue;
    GoldenRow row{path + ":" + std::to_string(number), {}};
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, '|');) {
      const std::size_t first = cell.find_first_not_of(' ');
      const std::size_t last = cell.find_last_not_of(' ');
      row.columns.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
    }
    EXPECT_EQ(row.columns.size(), width) << row.where;
    if (row.columns.size() == width) rows.push_back(std::move(row));
  }
  EXPECT_FALSE(rows.empty()) << path << " has no rows";
  return rows;
}

// "1A 00" as bytes.
inline std::vector<std::uint8_t> GoldenBytes(const std::string& text) {
  std::istringstream words(text);
  std::vector<std::uint8_t> bytes;
  for (std::string word; words >> word;) bytes.push_back(static_cast<std::uint8_t>(std::stoul(word, nullptr, 16)));
  return bytes;
}

}  // namespace axlecast
