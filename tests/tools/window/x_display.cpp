// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/window/x_display.h"

#include <X11/XKBlib.h>
#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <thread>

extern char** environ;

namespace shadowdag {

namespace {

Display* of(void* display) {
    return static_cast<Display*>(display);
}

void pause(double seconds) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

/// Events follow each other as a quick hand's do.
constexpr double kHandSeconds = 0.012;

/// Returns the top-level window of that title, or 0.
Window findWindow(Display* display, Window root, const std::string& title) {
    Window ignoredRoot, parent, found = 0;
    Window* children = nullptr;
    unsigned count = 0;
    if (!XQueryTree(display, root, &ignoredRoot, &parent, &children, &count))
        return 0;
    for (unsigned i = 0; i < count && found == 0; ++i) {
        char* name = nullptr;
        if (XFetchName(display, children[i], &name) && name != nullptr) {
            XWindowAttributes attributes;
            if (name == title && XGetWindowAttributes(display, children[i], &attributes) &&
                attributes.map_state == IsViewable)
                found = children[i];
            XFree(name);
        }
    }
    if (children != nullptr)
        XFree(children);
    return found;
}

} // namespace

double meanDifference(const Screenshot& a, const Screenshot& b, int x, int y, int width,
                      int height) {
    double sum = 0;
    for (int j = y; j < y + height; ++j)
        for (int i = x; i < x + width; ++i) {
            const glm::vec3 d = glm::abs(a.at(i, j) - b.at(i, j));
            sum += double(d.r + d.g + d.b) / 3.0;
        }
    return sum / (double(width) * double(height));
}

XDisplay::XDisplay(int width, int height) {
    // The server finds a free number by itself and writes it to the pipe.
    int ends[2];
    if (pipe(ends) != 0) {
        whyNot_ = "no pipe for Xvfb";
        return;
    }
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    const std::string screen = std::to_string(width) + "x" + std::to_string(height) + "x24";
    const std::string end = std::to_string(ends[1]);
    std::vector<std::string> texts{"Xvfb", "-displayfd", end,   "-screen", "0",
                                   screen, "-nolisten",  "tcp", "-noreset"};
    std::vector<char*> argv;
    for (std::string& text : texts)
        argv.push_back(text.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const int failed = posix_spawnp(&server_, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    if (failed != 0) {
        ::close(ends[0]);
        server_ = -1;
        whyNot_ = "Xvfb is not installed";
        return;
    }
    std::string text;
    pollfd waiting{ends[0], POLLIN, 0};
    char c = 0;
    while (poll(&waiting, 1, 20000) > 0 && read(ends[0], &c, 1) == 1 && c != '\n')
        text += c;
    ::close(ends[0]);
    if (text.empty()) {
        whyNot_ = "Xvfb did not start";
        return;
    }
    number_ = std::atoi(text.c_str());
    display_ = XOpenDisplay(name().c_str());
    int event = 0, error = 0, major = 0, minor = 0;
    if (display_ == nullptr) {
        whyNot_ = "Xvfb does not answer on " + name();
    } else if (!XTestQueryExtension(of(display_), &event, &error, &major, &minor)) {
        whyNot_ = "Xvfb has no XTest";
        XCloseDisplay(of(display_));
        display_ = nullptr;
    }
}

XDisplay::~XDisplay() {
    if (display_ != nullptr)
        XCloseDisplay(of(display_));
    if (server_ > 0) {
        kill(server_, SIGTERM);
        waitpid(server_, nullptr, 0);
    }
}

void XDisplay::flush() {
    XSync(of(display_), False);
    pause(kHandSeconds);
}

bool XDisplay::focus(const std::string& title, double seconds) {
    const Window root = DefaultRootWindow(of(display_));
    for (double waited = 0; waited < seconds; waited += 0.05) {
        window_ = findWindow(of(display_), root, title);
        if (window_ != 0) {
            XSetInputFocus(of(display_), window_, RevertToParent, CurrentTime);
            flush();
            return true;
        }
        pause(0.05);
    }
    return false;
}

void XDisplay::close() {
    XEvent event{};
    event.xclient.type = ClientMessage;
    event.xclient.window = window_;
    event.xclient.message_type = XInternAtom(of(display_), "WM_PROTOCOLS", False);
    event.xclient.format = 32;
    event.xclient.data.l[0] = long(XInternAtom(of(display_), "WM_DELETE_WINDOW", False));
    event.xclient.data.l[1] = CurrentTime;
    XSendEvent(of(display_), window_, False, NoEventMask, &event);
    flush();
}

void XDisplay::endServer() {
    XCloseDisplay(of(display_)); // or Xlib ends this process, too
    display_ = nullptr;
    kill(server_, SIGKILL);
    waitpid(server_, nullptr, 0);
    server_ = -1;
}

void XDisplay::resize(int width, int height) {
    XResizeWindow(of(display_), window_, unsigned(width), unsigned(height));
    flush();
}

void XDisplay::moveTo(int x, int y) {
    XTestFakeMotionEvent(of(display_), -1, x, y, CurrentTime);
    flush();
}

void XDisplay::click(int x, int y, int button) {
    moveTo(x, y);
    pause(0.05); // the interface draws once with the mouse there
    XTestFakeButtonEvent(of(display_), unsigned(button), True, CurrentTime);
    flush();
    pause(0.05);
    XTestFakeButtonEvent(of(display_), unsigned(button), False, CurrentTime);
    flush();
}

void XDisplay::drag(int x0, int y0, int x1, int y1, int button) {
    moveTo(x0, y0);
    pause(0.05);
    XTestFakeButtonEvent(of(display_), unsigned(button), True, CurrentTime);
    flush();
    constexpr int kSteps = 12;
    for (int i = 1; i <= kSteps; ++i)
        moveTo(x0 + (x1 - x0) * i / kSteps, y0 + (y1 - y0) * i / kSteps);
    pause(0.05);
    XTestFakeButtonEvent(of(display_), unsigned(button), False, CurrentTime);
    flush();
}

void XDisplay::key(const std::string& name, bool isDown) {
    const KeyCode code = XKeysymToKeycode(of(display_), XStringToKeysym(name.c_str()));
    XTestFakeKeyEvent(of(display_), code, isDown ? True : False, CurrentTime);
    flush();
}

void XDisplay::press(const std::string& name) {
    key(name, true);
}

void XDisplay::release(const std::string& name) {
    key(name, false);
}

void XDisplay::tap(const std::string& name) {
    press(name);
    pause(0.04);
    release(name);
}

bool XDisplay::drop(const std::string& path, int x, int y) {
    Display* const display = of(display_);
    const auto atom = [&](const char* text) { return XInternAtom(display, text, False); };
    const Window source =
        XCreateSimpleWindow(display, DefaultRootWindow(display), 0, 0, 1, 1, 0, 0, 0);
    const Atom selection = atom("XdndSelection"), list = atom("text/uri-list");
    XSetSelectionOwner(display, selection, source, CurrentTime);
    const auto send = [&](const char* type, long a, long b, long c, long d) {
        XEvent event{};
        event.xclient.type = ClientMessage;
        event.xclient.window = window_;
        event.xclient.message_type = atom(type);
        event.xclient.format = 32;
        event.xclient.data.l[0] = long(source);
        event.xclient.data.l[1] = a;
        event.xclient.data.l[2] = b;
        event.xclient.data.l[3] = c;
        event.xclient.data.l[4] = d;
        XSendEvent(display, window_, False, NoEventMask, &event);
        XSync(display, False);
    };
    send("XdndEnter", 5l << 24, long(list), 0, 0);
    send("XdndPosition", 0, long(x) << 16 | long(y), CurrentTime, long(atom("XdndActionCopy")));
    const std::string text = "file://" + path + "\r\n";
    bool isTaken = false, isDropped = false;
    for (int i = 0; i < 200 && !isTaken; ++i) {
        while (XPending(display) > 0) {
            XEvent event;
            XNextEvent(display, &event);
            if (event.type == ClientMessage && event.xclient.message_type == atom("XdndStatus") &&
                !isDropped) {
                isDropped = true;
                send("XdndDrop", 0, CurrentTime, 0, 0);
            } else if (event.type == SelectionRequest) {
                const XSelectionRequestEvent& asked = event.xselectionrequest;
                XChangeProperty(display, asked.requestor, asked.property, list, 8, PropModeReplace,
                                reinterpret_cast<const unsigned char*>(text.c_str()),
                                int(text.size()));
                XEvent reply{};
                reply.xselection.type = SelectionNotify;
                reply.xselection.requestor = asked.requestor;
                reply.xselection.selection = asked.selection;
                reply.xselection.target = asked.target;
                reply.xselection.property = asked.property;
                reply.xselection.time = asked.time;
                XSendEvent(display, asked.requestor, False, NoEventMask, &reply);
                XSync(display, False);
            } else if (event.type == ClientMessage &&
                       event.xclient.message_type == atom("XdndFinished")) {
                isTaken = true;
            }
        }
        pause(0.02);
    }
    XDestroyWindow(display, source);
    XSync(display, False);
    return isTaken;
}

Screenshot XDisplay::shoot() const {
    Display* const display = of(display_);
    const int screen = DefaultScreen(display);
    Screenshot shot;
    shot.width = DisplayWidth(display, screen);
    shot.height = DisplayHeight(display, screen);
    XImage* const image = XGetImage(display, DefaultRootWindow(display), 0, 0, unsigned(shot.width),
                                    unsigned(shot.height), AllPlanes, ZPixmap);
    for (int y = 0; y < shot.height; ++y)
        for (int x = 0; x < shot.width; ++x) {
            const unsigned long p = XGetPixel(image, x, y);
            shot.pixels.push_back(
                glm::vec3(float(p >> 16 & 0xff), float(p >> 8 & 0xff), float(p & 0xff)) / 255.0f);
        }
    XDestroyImage(image);
    return shot;
}

} // namespace shadowdag
