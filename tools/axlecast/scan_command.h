#pragma once

namespace CLI {
class App;
}

namespace axlecast {

// Adds `axlecast scan`.
void AddScanCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
