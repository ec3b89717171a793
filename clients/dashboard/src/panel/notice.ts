/** What is to be said over the scene: nothing there yet, something wrong, coming back. */

import type { Connection } from "../stream";
import { h, say } from "./dom";

export class Notice {
  readonly element = h("div", { class: "notice", attributes: { role: "status" } });
  private readonly title = h("strong");
  private readonly detail = h("span");
  private readonly tokenForm: HTMLFormElement;
  private readonly token = h("input", {
    attributes: {
      type: "password",
      autocomplete: "off",
      required: "",
      "aria-label": "token",
      placeholder: "token",
    },
  });

  /** @param use - Called with a token that somebody typed. */
  constructor(use: (token: string) => void) {
    this.tokenForm = h(
      "form",
      {
        class: "token",
        on: {
          submit: (event) => {
            event.preventDefault();
            use(this.token.value.trim());
            this.token.value = "";
          },
        },
      },
      this.token,
      h("button", {}, "Use it"),
      h("span", { class: "soft" }, "It stays in this tab."),
    );
    this.element.append(this.title, this.detail, this.tokenForm);
    this.element.hidden = true;
  }

  hide(): void {
    this.element.hidden = true;
  }

  tell(kind: "calm" | "warn" | "bad", title: string, detail: string, asksToken = false): void {
    this.element.hidden = false;
    this.element.dataset["kind"] = kind;
    say(this.title, title);
    say(this.detail, detail);
    this.tokenForm.hidden = !asksToken;
  }

  /** Says what the connection needs to have said; nothing while it is live. */
  tellConnection(connection: Connection): boolean {
    switch (connection.state) {
      case "live":
        return false;
      case "connecting":
        this.tell("calm", "Connecting", "to the service…");
        return true;
      case "reconnecting":
        this.tell(
          "warn",
          "Reconnecting",
          `${capital(connection.problem.message)}. What is shown is what was heard last; ` +
            "the page comes back by itself.",
        );
        return true;
      case "refused": {
        const { status, message } = connection.problem;
        if (status === 401 || status === 403) {
          this.tell("bad", "The service asks for a token", "", true);
        } else if (status === 404) {
          this.tell("bad", "There is no such space", "Choose another one above.");
        } else {
          this.tell("bad", "The service refuses", message);
        }
        return true;
      }
    }
  }
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
