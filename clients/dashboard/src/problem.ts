/** An answer of the service that is an error, in its own words. */
export class Problem extends Error {
  constructor(
    /** HTTP status; 0 where there was no answer. */
    readonly status: number,
    readonly title: string,
    readonly detail: string,
  ) {
    super(detail === "" ? title : `${title}: ${detail}`);
  }

  /** Reads the problem document of an answer, or makes do with its status. */
  static async of(answer: Response): Promise<Problem> {
    try {
      const document = (await answer.json()) as { title?: unknown; detail?: unknown };
      return new Problem(answer.status, String(document.title), String(document.detail ?? ""));
    } catch {
      return new Problem(answer.status, `the service answered ${answer.status}`, "");
    }
  }

  /** What any error is, as a problem. */
  static from(error: unknown): Problem {
    if (error instanceof Problem) {
      return error;
    }
    const isNetwork = error instanceof TypeError;
    return new Problem(0, isNetwork ? "the service does not answer" : String(error), "");
  }
}
