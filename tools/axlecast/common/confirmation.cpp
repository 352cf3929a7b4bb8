#include "tools/axlecast/common/confirmation.h"

#include <unistd.h>

#include <iostream>
#include <string>

namespace axlecast {

bool CanAsk(std::string_view what) {
  if (isatty(STDIN_FILENO) == 1) return true;
  std::cerr << what << " asks first, but standard input is no terminal: add --yes\n";
  return false;
}

bool Confirmed() {
  std::cerr << "Do it? [y/N] ";
  std::string answer;
  std::getline(std::cin, answer);
  if (answer == "y" || answer == "Y" || answer == "yes") return true;
  std::cerr << "nothing was done\n";
  return false;
}

}  // namespace axlecast
