// SPDX-License-Identifier: Apache-2.0
// A separate display for tests of the window: Xvfb, events through the XTest extension, which reach
// the program as a person's do, and pictures of the screen.
#pragma once

#include <glm/glm.hpp>

#include <sys/types.h>

#include <string>
#include <vector>

namespace shadowdag {

/// A picture of the screen.
struct Screenshot {
    int width = 0, height = 0;
    std::vector<glm::vec3> pixels; ///< display values, rows from the top

    const glm::vec3& at(int x, int y) const {
        return pixels[size_t(y) * size_t(width) + size_t(x)];
    }
};

/// Returns the mean over channels and pixels of |a - b| in a rectangle.
double meanDifference(const Screenshot& a, const Screenshot& b, int x, int y, int width,
                      int height);

/// Runs Xvfb while it lives.
class XDisplay {
public:
    /// Starts the server. isThere() is false where Xvfb or XTest is not to be had; whyNot() says
    /// why.
    XDisplay(int width, int height);
    ~XDisplay();
    XDisplay(const XDisplay&) = delete;
    XDisplay& operator=(const XDisplay&) = delete;

    bool isThere() const { return display_ != nullptr; }
    const std::string& whyNot() const { return whyNot_; }
    /// Returns what DISPLAY is to programs: ":99".
    std::string name() const { return ":" + std::to_string(number_); }

    /// Waits for a window with that title and gives it the keyboard; returns whether it came.
    bool focus(const std::string& title, double seconds);
    /// Asks the window that has the focus to close, as a window manager does.
    void close();
    /// Ends the server, as a connection that breaks does; nothing else may be called then.
    void endServer();
    /// Resizes it.
    void resize(int width, int height);

    void moveTo(int x, int y);
    /// Presses and lets go. @param button 1 left, 2 middle, 3 right, 4 wheel up, 5 wheel down
    void click(int x, int y, int button = 1);
    /// Presses at the first point, moves in steps to the second, lets go.
    void drag(int x0, int y0, int x1, int y1, int button = 1);
    /// @param name as XStringToKeysym takes it: "w", "F12", "space", "Tab"
    void press(const std::string& name);
    void release(const std::string& name);
    void tap(const std::string& name);
    /// Drops a file on the focused window by the XDND protocol; returns whether it was taken.
    bool drop(const std::string& path, int x, int y);

    Screenshot shoot() const;

private:
    void key(const std::string& name, bool isDown);
    void flush();

    void* display_ = nullptr; ///< Display*
    unsigned long window_ = 0;
    pid_t server_ = -1;
    int number_ = -1;
    std::string whyNot_;
};

} // namespace shadowdag
