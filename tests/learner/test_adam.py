import numpy as np
import torch

from berteam_cli.learner.adam import Adam, descend, untrained


def test_steps_are_those_of_torch_whether_the_gradient_is_shortened_or_not():
    rng = np.random.default_rng(0)
    first = rng.standard_normal((2, 40), dtype=np.float32)
    trained = untrained(first.copy())
    weights = torch.tensor(first[1], requires_grad=True)
    adam = torch.optim.Adam([weights], lr=0.01, eps=1e-3)
    for scale in (1.0, 0.01, 3.0, 0.0, 0.02):  # norms of about 6 times that, of which 1 is the largest allowed
        gradient = scale * rng.standard_normal(40, dtype=np.float32)
        weights.grad = torch.tensor(gradient)
        torch.nn.utils.clip_grad_norm_([weights], 1.0)
        adam.step()
        descend(Adam(learning_rate=0.01, epsilon=1e-3, max_grad_norm=1.0), trained.member(1), gradient)
        np.testing.assert_allclose(trained.weights[1], weights.detach().numpy(), atol=1e-6)
    np.testing.assert_array_equal(trained.weights[0], first[0])
    assert trained.updates.tolist() == [0, 5]
